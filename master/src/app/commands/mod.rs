//! Commands: each executes its arguments and returns its result.

mod bench;
mod check_numerics;
mod compile;
mod explain;
mod interrupt;
mod observability;
mod plot;
mod quality;
mod render;
mod shell;
mod simulate;
mod source;
mod tradeoff;
mod view;

use crate::app::cli::Command;
use crate::error::CommandError;

/// Executes a command.
///
/// # Errors
/// The reason of the failure, with the exit status.
pub(crate) fn run(command: Command) -> Result<(), CommandError> {
    if let Some(threads) = threads(&command) {
        limit_builds(threads);
    }
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
        Command::Trust(args) => crate::app::trust::run(&args),
        Command::Completions(args) => shell::completions(args),
        Command::Man(args) => shell::man(&args),
    }
}

/// Value of `--threads`.
fn threads(command: &Command) -> Option<usize> {
    match command {
        Command::View(args) => args.farm.threads,
        Command::Render(args) => args.farm.threads,
        Command::Bench(args) => args.threads,
        Command::Tradeoff(args) => args.threads,
        _ => None,
    }
}

/// Compiles models and scenes on that many threads. Without this call, they are compiled on all cores.
fn limit_builds(threads: usize) {
    if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global() {
        tracing::debug!("models are compiled on all cores: {error}");
    }
}

/// The runtime of the farm: sockets and timers only, so two threads suffice. Rendering never runs here.
fn runtime() -> Result<tokio::runtime::Runtime, CommandError> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| CommandError::Failed(format!("cannot start the network threads: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::Invocation;

    #[test]
    fn builds_use_the_threads_of_the_command_line() {
        let threads = |line: &str| match Invocation::parse(line.split(' ').map(Into::into)) {
            Ok(Invocation::Command(command, _)) => threads(&command),
            other => panic!("{line}: {other:?}"),
        };
        assert_eq!(threads("rayfarm-master render --threads 3 -o none a.obj"), Some(3));
        assert_eq!(threads("rayfarm-master --threads 2 a.obj"), Some(2));
        assert_eq!(threads("rayfarm-master bench --threads 1 a.toml"), Some(1));
        assert_eq!(threads("rayfarm-master tradeoff a.toml -o b --threads 4"), Some(4));
        assert_eq!(threads("rayfarm-master render -o none a.obj"), None);
        assert_eq!(threads("rayfarm-master explain a.toml"), None);
    }
}
