//! One session with a master: a state machine without I/O, and the runner that performs its effects.

mod frames;
mod idle_timeout;
mod runner;
mod state;
mod work;

pub(crate) use runner::{PersistentState, SessionConfig, SessionEnd, run_session};
