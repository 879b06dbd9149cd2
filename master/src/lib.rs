//! The master of rayfarm: owns the scene and the screen, hands out segments, assembles frames.
//!
//! The seam between what draws and what renders is [`farm::Farm`]: everything above it (command line, window,
//! reports) asks for frames and shows them; everything below it (scheduler, sessions, framebuffers, local worker
//! processes) sees to it that each one completes.

mod camera_control;
mod cli;
mod commands;
mod control;
mod dial;
mod display;
mod error;
mod in_process;
mod logging;
mod measure;
mod orbit;
mod output;
mod plan;
mod progress;
mod report;
mod wanted;

pub use rayfarm_farm as farm;
pub use rayfarm_scheduler as scheduler;

use std::ffi::OsString;
use std::process::ExitCode;

use cli::Invocation;
pub use measure::simulator;
use rayfarm_farm::accounting;
#[cfg(test)]
use rayfarm_farm::testing::{fake_worker, test_scene};

/// The whole program: does what the command line (program name first) asks for and says how it went.
///
/// Exit status: 0 done; 2 wrong use or wrong input; 1 anything else. What is wrong is told on standard error.
pub fn main_with_args(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let (command, log) = match Invocation::parse(args) {
        Ok(Invocation::LocalWorker(args)) => return rayfarm_worker::cli::main_from(args),
        Ok(Invocation::Command(command, log)) => (command, log),
        Err(error) => {
            let _ = error.print(); // there is nowhere left to say that it could not be said
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(1));
        }
    };
    logging::start(log);
    match commands::run(*command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            error.exit_code()
        }
    }
}
