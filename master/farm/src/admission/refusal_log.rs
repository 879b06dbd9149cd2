//! Log lines about refused connections of all hosts, at a bounded rate: an unauthenticated peer must not fill a disk with them.

use std::fmt::Display;
use std::net::SocketAddr;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::bucket::Rate;
use crate::line_budget::{LineBudget, more};

/// Log lines about refused connections.
const LINES: Rate = Rate { burst: 20.0, per_second: 1.0 };

/// Log of refused connections.
#[derive(Debug)]
pub(crate) struct RefusalLog(Mutex<LineBudget>);

impl RefusalLog {
    pub(crate) fn new(now: Instant) -> Self {
        Self(Mutex::new(LineBudget::new(LINES, now)))
    }

    /// Logs a refusal, or counts it.
    pub(crate) fn log(&self, address: SocketAddr, error: &dyn Display) {
        match self.count(Instant::now()) {
            Some(left_out) => tracing::warn!("{address} is refused: {error}{}", more(left_out)),
            None => tracing::debug!("{address} is refused: {error}"),
        }
    }

    /// Whether a refusal is to be logged, with the number of those that were not logged before.
    fn count(&self, now: Instant) -> Option<u64> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).next(now)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn refusals_beyond_the_rate_are_counted() {
        let start = Instant::now();
        let log = RefusalLog::new(start);
        let logged = (0..1000).filter(|_| log.count(start) == Some(0)).count();
        assert_eq!(logged as f64, LINES.burst);
        assert_eq!(log.count(start + Duration::from_secs(1)), Some(980));
        assert_eq!(log.count(start + Duration::from_secs(1)), None);
        assert_eq!(log.count(start + Duration::from_secs(2)), Some(1));
    }
}
