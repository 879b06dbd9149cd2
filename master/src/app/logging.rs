//! The log on standard error.

use std::time::SystemTime;

use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::FormatTime;

use crate::app::cli::LogArgs;
use crate::log_bar::LogWriter;

/// Times of the log: hours, minutes and seconds in UTC, as in `14:05:09Z`. Logs are read live, and no time zone is needed.
#[derive(Clone, Copy, Debug)]
struct TimeOfDay;

impl FormatTime for TimeOfDay {
    fn format_time(&self, out: &mut Writer<'_>) -> std::fmt::Result {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        write!(out, "{}", time_of_day(since.as_secs()))
    }
}

/// Time of day of a Unix time in seconds.
fn time_of_day(seconds: u64) -> String {
    let seconds = seconds % 86_400;
    format!("{:02}:{:02}:{:02}Z", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

/// Starts the log at level `INFO`, or at the level that the options or `RUST_LOG` set; the latter has priority.
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
        .with_writer(|| LogWriter)
        .with_target(args.verbose)
        .with_ansi(colors)
        .with_timer(TimeOfDay)
        .finish();
    // Fails only in tests, after the first one has set a subscriber.
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
