//! Stalls: workers that hold leases and finish none. A slow worker makes progress; a stuck one does not.

use std::fmt;
use std::time::Duration;

/// Longest time that reports of progress alone keep a worker connected, in stall timeouts per tile band of its leases.
const TIMEOUTS_PER_BAND: u32 = 60;

/// Progress of a worker since it last finished a lease, or since it holds leases.
///
/// A worker is stalled after the stall timeout without progress. It reports progress itself, so the time without a
/// finished lease has a limit as well: [`TIMEOUTS_PER_BAND`] times the stall timeout for each tile band that it holds. With
/// the first timeout of 60 s, that is an hour per band. Meanwhile other workers render its overdue rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stall {
    /// When it last finished a lease, or received one while it held none.
    since: Duration,
    /// When it last made progress; `since` at first.
    progress_at: Duration,
}

/// Why a worker is disconnected as stalled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StallReason {
    /// No progress for this long.
    NoProgress(Duration),
    /// Progress, but no finished lease for this long.
    NothingFinished(Duration),
}

impl Stall {
    pub(super) fn new(now: Duration) -> Self {
        Self { since: now, progress_at: now }
    }

    pub(super) fn note_progress(&mut self, now: Duration) {
        self.progress_at = now;
    }

    /// When a worker that holds this number of tile bands is disconnected unless it goes on, and the reason.
    pub(super) fn deadline(self, timeout: Duration, bands: u32) -> (Duration, StallReason) {
        let limit = timeout.saturating_mul(bands.max(1).saturating_mul(TIMEOUTS_PER_BAND));
        let idle_at = self.progress_at.saturating_add(timeout);
        let limit_at = self.since.saturating_add(limit);
        if idle_at <= limit_at {
            (idle_at, StallReason::NoProgress(timeout))
        } else {
            (limit_at, StallReason::NothingFinished(limit))
        }
    }
}

impl fmt::Display for StallReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoProgress(time) => {
                write!(f, "it holds leases and has made no progress for {} s", time.as_secs())
            }
            Self::NothingFinished(time) => {
                write!(f, "it holds leases and has finished none for {} s", time.as_secs())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);
    const TIMEOUT: Duration = Duration::from_secs(60);

    #[test]
    fn progress_extends_the_time_up_to_the_limit_of_the_bands() {
        let mut stall = Stall::new(SECOND);
        assert_eq!(stall.deadline(TIMEOUT, 2), (SECOND * 61, StallReason::NoProgress(TIMEOUT)));
        stall.note_progress(SECOND * 7000);
        assert_eq!(stall.deadline(TIMEOUT, 2), (SECOND * 7060, StallReason::NoProgress(TIMEOUT)));
        stall.note_progress(SECOND * 7200);
        let limit = SECOND * 7200;
        assert_eq!(stall.deadline(TIMEOUT, 2), (SECOND + limit, StallReason::NothingFinished(limit)));
        assert_eq!(stall.deadline(TIMEOUT, 3), (SECOND * 7260, StallReason::NoProgress(TIMEOUT)));
    }

    #[test]
    fn deadlines_do_not_overflow() {
        let stall = Stall::new(Duration::MAX);
        assert_eq!(stall.deadline(Duration::MAX, u32::MAX).0, Duration::MAX);
        assert_eq!(Stall::new(SECOND).deadline(TIMEOUT, 0).0, SECOND * 61);
    }
}
