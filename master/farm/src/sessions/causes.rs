//! Messages of a worker that need a cause: a pong needs a ping, a failure needs an announced frame or a lease.

use std::collections::BTreeSet;

/// Pings that wait for their pongs. A worker with more is disconnected by its timeouts long before.
const MAX_OPEN_PINGS: usize = 64;
/// Pongs without a ping that are ignored. One more ends the session.
const MAX_STRAY_PONGS: u32 = 8;

/// What one worker may still report.
#[derive(Debug, Default)]
pub(crate) struct Causes {
    pings: BTreeSet<u64>,
    stray_pongs: u32,
    /// Failures that it may report: one for each announcement and each lease.
    failures: u64,
}

/// Outcome of checking a pong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PongStatus {
    /// It answers an open ping.
    Open,
    /// It answers no open ping and is ignored.
    Stray,
    /// Too many answered no open ping.
    TooMany,
}

impl Causes {
    /// Records that a ping is sent.
    pub(crate) fn ping(&mut self, nonce: u64) {
        self.pings.insert(nonce);
        if self.pings.len() > MAX_OPEN_PINGS {
            // Nonces grow, so this is the oldest.
            self.pings.pop_first();
        }
    }

    /// Checks a pong, so that each ping accepts one.
    pub(crate) fn pong(&mut self, nonce: u64) -> PongStatus {
        if self.pings.remove(&nonce) {
            return PongStatus::Open;
        }
        self.stray_pongs += 1;
        if self.stray_pongs > MAX_STRAY_PONGS { PongStatus::TooMany } else { PongStatus::Stray }
    }

    /// Records that a frame is announced or a lease is granted.
    pub(crate) fn allow_failure(&mut self) {
        self.failures += 1;
    }

    /// Checks a failure. Returns whether there was a cause for it.
    pub(crate) fn failed(&mut self) -> bool {
        let has_cause = self.failures > 0;
        self.failures = self.failures.saturating_sub(1);
        has_cause
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_ping_accepts_one_pong() {
        let mut causes = Causes::default();
        (1..=3).for_each(|nonce| causes.ping(nonce));
        assert_eq!([1, 3, 2].map(|nonce| causes.pong(nonce)), [PongStatus::Open; 3]);
        assert_eq!([0; MAX_STRAY_PONGS as usize].map(|_| causes.pong(3)), [PongStatus::Stray; 8]);
        assert_eq!(causes.pong(3), PongStatus::TooMany);
        causes.ping(4);
        assert_eq!(causes.pong(4), PongStatus::Open);
    }

    #[test]
    fn the_number_of_open_pings_is_bounded() {
        let mut causes = Causes::default();
        (0..1000).for_each(|nonce| causes.ping(nonce));
        assert_eq!(causes.pings.len(), MAX_OPEN_PINGS);
        assert_eq!([causes.pong(0), causes.pong(999)], [PongStatus::Stray, PongStatus::Open]);
    }

    #[test]
    fn a_failure_needs_an_announcement_or_a_lease() {
        let mut causes = Causes::default();
        assert!(!causes.failed());
        causes.allow_failure();
        assert_eq!([causes.failed(), causes.failed()], [true, false]);
    }
}
