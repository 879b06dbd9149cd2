//! The worker's command line, for its own binary and for the master, which starts itself as a local worker.

mod args;
mod farms;

use std::ffi::OsString;
use std::io::IsTerminal;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand};
use tracing_subscriber::EnvFilter;

pub use args::{FarmArgs, NAME_VARIABLE, PixelEncoding, WorkerArgs};

use super::client::run_targets;
use super::doctor::{self, Report};
use super::priority::lower_priority;
use super::signals::{shut_down_on_signals, stop_at_end_of_stdin};
use crate::shutdown::ShutdownHandle;
use crate::tracer::TracerRenderer;

/// A render node of rayfarm: traces segments for a master with all cores.
#[derive(Debug, Parser)]
#[command(name = "rayfarm-worker", version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,

    #[command(flatten)]
    worker: WorkerArgs,
}

/// Commands other than to render.
#[derive(Debug, Subcommand)]
enum Command {
    /// List the remembered masters
    Masters,
    /// Forget remembered masters
    Forget(ForgetArgs),
    /// Check step by step whether this machine can join a farm
    Doctor(FarmArgs),
}

/// Arguments of `forget`.
#[derive(Debug, Args)]
struct ForgetArgs {
    /// Name, address, or first eight or more digits of the key of a master
    #[arg(value_name = "NAME|HASH", required_unless_present = "all")]
    master: Option<String>,

    /// Forget all masters
    #[arg(long, conflicts_with = "master")]
    all: bool,
}

/// Failure of a start.
#[derive(Debug, PartialEq, Eq)]
enum StartError {
    /// The command line, or what it refers to, names no master.
    Usage(String),
    /// Anything else.
    Failure(String),
}

/// Definition of the worker's command line, for completions and manual pages.
pub fn command_line() -> clap::Command {
    Cli::command()
}

/// Runs the program: parses `args` (the first is the program's name), logs to standard error, and renders. The exit code
/// is 0 after a disconnect or a signal, 1 after an error, 2 for a wrong command line.
pub fn main_from<I>(args: I) -> ExitCode
where
    I: IntoIterator,
    I::Item: Into<OsString> + Clone,
{
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => {
            // A failure to print has no other output to report it.
            let _ = error.print();
            return u8::try_from(error.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from);
        }
    };
    match cli.command {
        None => main_with(&cli.worker),
        Some(command) => {
            log_to_stderr(&cli.worker);
            let result = match command {
                Command::Masters => farms::list_masters(),
                Command::Forget(args) => farms::forget_masters(args.master.as_deref()),
                Command::Doctor(farm) => run_doctor(&farm),
            };
            exit_code(result)
        }
    }
}

/// Runs the program with parsed arguments: see [`main_from`]. Installs its own logging where none is installed.
pub fn main_with(args: &WorkerArgs) -> ExitCode {
    log_to_stderr(args);
    if let Some(niceness) = args.nice {
        lower_priority(niceness);
    }
    exit_code(render(args))
}

fn render(args: &WorkerArgs) -> Result<(), StartError> {
    let runtime = start_runtime()?;
    // Reads a join line of standard input before the end of standard input is watched.
    let targets = farms::targets(&args.farm, !args.no_remember && !args.exit_with_stdin)?;
    let shutdown = ShutdownHandle::new();
    if args.exit_with_stdin {
        stop_at_end_of_stdin(shutdown.clone());
    }
    let result = runtime.block_on(async {
        tokio::spawn(shut_down_on_signals(shutdown.clone()));
        run_targets(TracerRenderer, args.options(), targets, shutdown).await
    });
    // Does not wait for a mesh that is being decoded.
    runtime.shutdown_background();
    result.map_err(|error| StartError::Failure(error.to_string()))
}

fn run_doctor(farm: &FarmArgs) -> Result<(), StartError> {
    let runtime = start_runtime()?;
    let targets = farms::targets(farm, false)?;
    let mut report = Report::default();
    runtime.block_on(doctor::check(targets, &mut report));
    runtime.shutdown_background();
    if report.has_passed() { Ok(()) } else { Err(StartError::Failure("a check has failed".to_owned())) }
}

fn start_runtime() -> Result<tokio::runtime::Runtime, StartError> {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
    runtime.map_err(|error| StartError::Failure(format!("cannot start: {error}")))
}

fn exit_code(result: Result<(), StartError>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(StartError::Failure(why)) => {
            tracing::error!("{why}");
            ExitCode::FAILURE
        }
        Err(StartError::Usage(why)) => {
            tracing::error!("{why}");
            ExitCode::from(2)
        }
    }
}

/// Installs a log to standard error. `RUST_LOG` takes precedence over the flags.
fn log_to_stderr(args: &WorkerArgs) {
    let level = match (args.verbose, args.quiet) {
        (true, _) => "debug",
        (_, true) => "error",
        _ => "info",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    let log = log.with_target(false).with_ansi(std::io::stderr().is_terminal());
    // Fails where the program has installed its own log.
    let _ = log.try_init();
}
