//! What one session may send in addition to pixels. Pixels are bounded by leases; everything else costs the master time, log lines or bytes, so
//! it has a budget, and a worker that exceeds it is disconnected.

use std::collections::BTreeMap;
use std::time::Instant;

use rayfarm_protocol::{AssetId, ToMaster};

use crate::bucket::Bucket;

/// Small messages at once, and per second. A scene with thousands of textures is requested at once.
const MESSAGES: (f64, f64) = (8192.0, 200.0);
/// Failures at once, and per second: at most one for each announced frame, and a master announces few frames beyond 60 a second.
const FAILURES: (f64, f64) = (128.0, 60.0);
/// Requests for one asset: the first, and some after failed transfers.
const REQUESTS_OF_ASSET: u32 = 4;
/// Assets that one session requests.
const MAX_ASSETS: usize = 65_536;

/// A worker sends more than its work needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum OverBudget {
    /// Too many messages.
    #[error("it sends more than {} messages per second in addition to pixels", MESSAGES.1)]
    Messages,
    /// Too many failures.
    #[error("it reports more than {} failures per second", FAILURES.1)]
    Failures,
    /// Too many requests for one asset, or for different ones.
    #[error("it requests an asset more than {REQUESTS_OF_ASSET} times, or more than {MAX_ASSETS} assets")]
    Requests,
}

/// The budget of one session.
#[derive(Debug)]
pub(crate) struct Budget {
    messages: Bucket,
    failures: Bucket,
    requests: BTreeMap<AssetId, u32>,
}

impl Budget {
    pub(crate) fn new(now: Instant) -> Self {
        Self {
            messages: Bucket::new(MESSAGES, now),
            failures: Bucket::new(FAILURES, now),
            requests: BTreeMap::new(),
        }
    }

    /// Counts a message.
    ///
    /// # Errors
    /// A message beyond the budget.
    pub(crate) fn count(&mut self, message: &ToMaster, now: Instant) -> Result<(), OverBudget> {
        if matches!(message, ToMaster::Pixels { .. }) {
            return Ok(());
        }
        self.messages.take(now).ok_or(OverBudget::Messages)?;
        match message {
            ToMaster::Failed { .. } => self.failures.take(now).ok_or(OverBudget::Failures),
            ToMaster::NeedAsset { id, .. } => {
                let is_full = self.requests.len() >= MAX_ASSETS && !self.requests.contains_key(id);
                let requests = self.requests.entry(*id).or_default();
                *requests += 1;
                if is_full || *requests > REQUESTS_OF_ASSET { Err(OverBudget::Requests) } else { Ok(()) }
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use rayfarm_protocol::FrameId;

    use super::*;

    #[test]
    fn a_flood_ends_and_a_steady_rate_does_not() {
        let start = Instant::now();
        let mut budget = Budget::new(start);
        let pong = ToMaster::Pong { nonce: 0, progressed: false };
        let flood = (0..).take_while(|_| budget.count(&pong, start).is_ok()).take(100_000).count();
        assert_eq!(flood as f64, MESSAGES.0);
        assert_eq!(budget.count(&pong, start), Err(OverBudget::Messages));
        for step in 1..10_000 {
            let now = start + Duration::from_millis(10 * step);
            assert_eq!(budget.count(&pong, now), Ok(()), "100 a second");
        }
    }

    #[test]
    fn failures_and_requests_have_bounds_of_their_own() {
        let now = Instant::now();
        let mut budget = Budget::new(now);
        let failed = ToMaster::Failed { frame: FrameId(1), reason: "no".to_owned() };
        let flood = (0..).take_while(|_| budget.count(&failed, now).is_ok()).take(100_000).count();
        assert_eq!(flood as f64, FAILURES.0);
        let need = |byte| ToMaster::NeedAsset { id: AssetId([byte; 32]), offset: 0, again: true };
        for _ in 0..REQUESTS_OF_ASSET {
            assert_eq!(budget.count(&need(1), now), Ok(()));
        }
        assert_eq!(budget.count(&need(1), now), Err(OverBudget::Requests));
        assert_eq!(budget.count(&need(2), now), Ok(()));
    }
}
