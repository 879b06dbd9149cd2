//! The wire from outside. One program, so that the crate is linked once.

#![allow(clippy::panic, clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;
mod golden;
mod handshakes;
mod hostile;
mod passing;
mod properties;
mod sessions;
mod torn_pipes;
