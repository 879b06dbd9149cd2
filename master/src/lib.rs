//! The master of rayfarm: owns the scene and the screen, hands out segments, assembles frames.
//!
//! [`rayfarm_farm::Farm`] is the boundary between displays and rendering. The code above it (application, viewer, displays)
//! requests frames and shows them. The code below it (scheduler, sessions, framebuffers, local worker processes) completes each
//! one.

mod app;
mod display;
mod error;
mod in_process;
mod log_bar;
mod log_lines;
mod measure;
mod quantile;
#[cfg(test)]
mod test_worker;
#[cfg_attr(
    not(feature = "window"),
    allow(dead_code, reason = "only displays send input and read statistics")
)]
mod viewer;

use std::ffi::OsString;
use std::process::ExitCode;

use app::cli::Invocation;
use app::{commands, logging};
pub use measure::simulator;

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
