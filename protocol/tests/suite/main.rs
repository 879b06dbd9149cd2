//! Integration tests of the protocol, as one program, so that the crate is linked once.

#![allow(clippy::panic, clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;
mod faulty_pipes;
mod golden;
mod handshakes;
mod hostile;
mod peer;
mod properties;
mod sessions;
mod trust;
