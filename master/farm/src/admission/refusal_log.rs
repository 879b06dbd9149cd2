//! Log lines about refused connections, at a bounded rate: an unauthenticated peer must not fill a disk with them.

use std::fmt::Display;
use std::net::SocketAddr;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::bucket::Bucket;

/// Lines at once, and per second.
const LINES: (f64, f64) = (20.0, 1.0);

/// Log of refused connections.
#[derive(Debug)]
pub(crate) struct RefusalLog(Mutex<State>);

#[derive(Debug)]
struct State {
    lines: Bucket,
    left_out: u64,
}

impl RefusalLog {
    pub(crate) fn new(now: Instant) -> Self {
        Self(Mutex::new(State { lines: Bucket::new(LINES, now), left_out: 0 }))
    }

    /// Logs a refusal, or counts it.
    pub(crate) fn log(&self, address: SocketAddr, error: &dyn Display) {
        if let Some(left_out) = self.count(Instant::now()) {
            let more =
                if left_out == 0 { String::new() } else { format!(" ({left_out} others were not logged)") };
            tracing::warn!("{address} is refused: {error}{more}");
        }
    }

    /// Whether a refusal is to be logged, with the number of those that were not logged before.
    fn count(&self, now: Instant) -> Option<u64> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match state.lines.take(now) {
            Some(()) => Some(std::mem::take(&mut state.left_out)),
            None => {
                state.left_out += 1;
                None
            }
        }
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
        assert_eq!(logged as f64, LINES.0);
        assert_eq!(log.count(start + Duration::from_secs(1)), Some(980));
        assert_eq!(log.count(start + Duration::from_secs(1)), None);
        assert_eq!(log.count(start + Duration::from_secs(2)), Some(1));
    }
}
