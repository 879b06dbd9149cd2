//! The master of rayfarm: owns the scene and the screen, hands out segments, assembles frames.
//!
//! The seam between what draws and what renders is [`farm::Farm`]: everything above it (command line, window,
//! reports) asks for frames and shows them; everything below it (scheduler, sessions, framebuffers, local worker
//! processes) sees to it that each one completes.

mod accounting;
mod addresses;
mod app;
mod assets;
mod chains;
mod delivered;
mod display;
mod driver;
pub mod farm;
mod farm_control;
mod framebuffer;
mod identity;
mod in_process;
mod judge;
mod lease_book;
mod local_workers;
mod pace;
mod plot;
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
