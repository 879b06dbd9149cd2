//! Tests of the worker with masters over sockets, as one program, so that the worker is linked once.

#![allow(clippy::panic, clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;
mod process;
mod tcp;
mod trust;
