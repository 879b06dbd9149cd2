//! Tools for tests that run the real programs. No program depends on them; they panic where a test would fail.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "used by tests only")]

mod browser;
mod process;
mod programs;
mod require;
mod scenes;
mod screen;

pub use browser::Browser;
pub use process::{Outcome, Running, wait_until};
pub use programs::{master, worker};
pub use require::require;
pub use scenes::{Scenes, bumps, project_root, shared};
pub use screen::Screen;

use std::net::TcpListener;

/// Returns a TCP port of this machine that is free at the moment.
pub fn free_port() -> u16 {
    TcpListener::bind(("127.0.0.1", 0)).unwrap().local_addr().unwrap().port()
}
