//! End-to-end tests: real processes, faults, bad input, a window on a virtual screen. One program, so that it is linked
//! once.

#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test fails by panicking")]

mod accounting;
mod bad_input;
mod bench_farm;
mod black_pixels;
mod command_line;
mod control;
mod documents;
mod faults;
#[cfg(unix)]
mod full_farm;
#[cfg(unix)]
mod launch;
mod resume;
mod same_picture;
mod tradeoff;
mod trust;
mod video;
mod web;
mod window;
mod window_controls;
