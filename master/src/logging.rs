//! What the program tells on standard error while it works.

use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;

use crate::cli::LogArgs;
use crate::progress::AboveTheBar;

/// Starts telling: warnings and milestones; more or less as asked for; exactly as `RUST_LOG` says where it is set.
pub(crate) fn start(args: LogArgs) {
    let level = match (args.verbose, args.quiet) {
        (true, _) => LevelFilter::DEBUG,
        (_, true) => LevelFilter::ERROR,
        _ => LevelFilter::INFO,
    };
    let filter = EnvFilter::builder().with_default_directive(level.into()).from_env_lossy();
    let colors = std::io::IsTerminal::is_terminal(&std::io::stderr());
    let subscriber = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(|| AboveTheBar)
        .with_target(args.verbose)
        .with_ansi(colors)
        .without_time()
        .finish();
    // Fails only where a test has set one already.
    let _ = tracing::subscriber::set_global_default(subscriber);
}
