//! The worker as an application: command line, signals, and a client that connects to the master and reconnects.

mod backoff;
pub mod cli;
mod client;
mod options;
mod outage_log;
mod signals;

pub use client::{run, run_with};
pub use options::{DiskCacheOptions, Share, WorkerOptions};
