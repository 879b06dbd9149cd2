//! The worker as an application: command line, signals, and a client that connects to the master and reconnects.

mod backoff;
pub mod cli;
mod client;
mod discovery;
mod doctor;
mod memory;
mod options;
mod outage_log;
mod priority;
mod signals;
mod target;
mod terminal;
mod trust;

pub use client::{run, run_with};
pub use options::{DiskCacheOptions, Share, WorkerOptions};
