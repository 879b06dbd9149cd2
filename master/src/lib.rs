//! The master of rayfarm: owns the scene and the screen, hands out segments, assembles frames.
//!
//! [`farm::Farm`] is the boundary between displays and rendering. The code above it (application, viewer, displays) requests
//! frames and shows them. The code below it (scheduler, sessions, framebuffers, local worker processes) completes each one.

mod accounting;
mod addresses;
mod app;
mod assets;
mod chains;
mod delivered;
mod display;
mod driver;
mod error;
pub mod farm;
mod farm_control;
mod framebuffer;
mod identity;
mod in_process;
mod judge;
mod lease_book;
mod local_workers;
mod log_bar;
mod pace;
mod plot;
mod quantile;
mod roster;
pub mod scheduler;
mod seals;
mod server;
pub mod simulator;
mod tradeoff;
mod transfers;
mod viewer;

#[cfg(test)]
mod fake_worker;
#[cfg(test)]
mod farm_tests;
#[cfg(test)]
mod passing_tests;
#[cfg(test)]
mod test_scene;
#[cfg(test)]
mod verify_tests;

use std::ffi::OsString;
use std::process::ExitCode;

use app::cli::Invocation;
use app::{commands, logging};

/// Runs the program for a command line, program name first. Errors are printed on standard error.
///
/// Exit status: 0 success; 2 wrong use or wrong input; 1 any other failure.
pub fn main_with_args(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let (command, log) = match Invocation::parse(args) {
        Ok(Invocation::LocalWorker(args)) => return rayfarm_worker::cli::main_from(args),
        Ok(Invocation::Command(command, log)) => (command, log),
        Err(error) => {
            let _ = error.print(); // a failure to print cannot be reported anywhere
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
