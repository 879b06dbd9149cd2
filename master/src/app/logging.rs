//! What the program tells on standard error while it works.

use std::time::SystemTime;

use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::FormatTime;

use crate::app::cli::LogArgs;
use crate::app::progress::AboveTheBar;

/// Hours, minutes and seconds in UTC, as in `14:05:09Z`: runs are watched live, and no time zone has to be known.
#[derive(Clone, Copy, Debug)]
struct TimeOfDay;

impl FormatTime for TimeOfDay {
    fn format_time(&self, out: &mut Writer<'_>) -> std::fmt::Result {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        write!(out, "{}", time_of_day(since.as_secs()))
    }
}

/// Of a moment in seconds since 1970.
fn time_of_day(seconds: u64) -> String {
    let seconds = seconds % 86_400;
    format!("{:02}:{:02}:{:02}Z", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

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
        .with_timer(TimeOfDay)
        .finish();
    // Fails only where a test has set one already.
    let _ = tracing::subscriber::set_global_default(subscriber);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_short_and_in_utc() {
        assert_eq!(time_of_day(0), "00:00:00Z");
        assert_eq!(time_of_day(1_796_046_605), "13:50:05Z");
        assert_eq!(time_of_day(86_399), "23:59:59Z");
    }
}
