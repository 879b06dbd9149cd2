//! Tools for tests that run the real programs. Not part of any program: a test fails by panicking, so these may too.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "used by tests only")]

mod process;
mod programs;
mod scenes;
mod screen;

pub use process::{Outcome, Running, wait_until};
pub use programs::{master, worker};
pub use scenes::{Scenes, bumps, project_root, shared};
pub use screen::Screen;

use std::net::TcpListener;

/// A port of this machine that is free now.
pub fn free_port() -> u16 {
    TcpListener::bind(("127.0.0.1", 0)).unwrap().local_addr().unwrap().port()
}
