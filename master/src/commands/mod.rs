//! The commands: each turns its arguments into work and tells how it went.

mod bench;
mod check_numerics;
mod compile;
mod explain;
mod interrupt;
mod ladder;
mod oversight;
mod plot;
mod render;
mod simulate;
mod source;
mod tradeoff;
mod view;

use crate::cli::Command;
use crate::error::CommandError;

/// Does what the command line asks for.
///
/// # Errors
/// Whatever kept it from being done, with the exit status that tells whose fault it was.
pub(crate) fn run(command: Command) -> Result<(), CommandError> {
    match command {
        Command::View(args) => view::run(args),
        Command::Render(args) => render::run(args),
        Command::Compile(args) => compile::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Plot(args) => plot::run(&args),
        Command::Explain(args) => explain::run(&args),
        Command::CheckNumerics(args) => check_numerics::run(&args),
        Command::Tradeoff(args) => tradeoff::run(&args),
    }
}

/// The runtime that the farm lives on: sockets and timers only, so two threads are plenty. Rendering never runs here.
fn runtime() -> Result<tokio::runtime::Runtime, CommandError> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| CommandError::Failed(format!("cannot start the network threads: {error}")))
}
