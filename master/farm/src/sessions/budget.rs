//! What one session may send in addition to pixels. Pixels are bounded by leases; everything else costs the master time, log lines or bytes, so
//! it has a budget, and a worker that exceeds it is disconnected.

use std::collections::BTreeMap;
use std::time::Instant;

use rayfarm_protocol::{AssetId, ToMaster};

use crate::bucket::{Bucket, Rate};

/// Small messages. A scene with thousands of textures is requested at once.
const MESSAGES: Rate = Rate { burst: 8192.0, per_second: 200.0 };
/// Small messages that each replaced scene causes: requests and reports of its body and what is new in it. In a sequence every frame
/// may have a scene of its own, and small frames follow each other faster than [`MESSAGES`] would allow.
const MESSAGES_OF_SCENE: f64 = 8.0;
/// Failures: at most one for each announced frame, and a master announces few frames beyond 60 a second.
const FAILURES: Rate = Rate { burst: 128.0, per_second: 60.0 };
/// Requests for one asset, until the scene is replaced: the first, and some after failed transfers.
const REQUESTS_OF_ASSET: u32 = 4;
/// Requests for assets that no scene of the farm has, until the scene is replaced.
const MAX_UNKNOWN: u32 = 64;

/// A worker sends more than its work needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum OverBudget {
    /// Too many messages.
    #[error("it sends more than {} messages per second in addition to pixels", MESSAGES.per_second)]
    Messages,
    /// Too many failures.
    #[error("it reports more than {} failures per second", FAILURES.per_second)]
    Failures,
    /// Too many requests for one asset.
    #[error("it requests an asset more than {REQUESTS_OF_ASSET} times")]
    Requests,
    /// Too many requests for unknown assets.
    #[error("it requests more than {MAX_UNKNOWN} assets that no scene of the farm has")]
    Unknown,
    /// A report about an asset that it has not requested, or has reported before.
    #[error("it reports an asset as received that it has not requested")]
    Reports,
}

/// The budget of one session.
#[derive(Debug)]
pub(crate) struct Budget {
    messages: Bucket,
    failures: Bucket,
    /// Numbers of requests and of reports about assets of the farm's scenes.
    assets: BTreeMap<AssetId, (u32, u32)>,
    unknown: u32,
}

impl Budget {
    pub(crate) fn new(now: Instant) -> Self {
        Self {
            messages: Bucket::new(MESSAGES, now),
            failures: Bucket::new(FAILURES, now),
            assets: BTreeMap::new(),
            unknown: 0,
        }
    }

    /// Begins to count again after the scene was replaced: a worker that keeps few assets may need one again that it had.
    /// Open requests remain, because reports about them may follow.
    pub(crate) fn scene_replaced(&mut self, has_asset: impl Fn(AssetId) -> bool) {
        self.messages.give(MESSAGES_OF_SCENE);
        self.unknown = 0;
        self.assets.retain(|id, (requests, reports)| {
            (*requests, *reports) = (requests.saturating_sub(*reports).min(1), 0);
            *requests > 0 && has_asset(*id)
        });
    }

    /// Counts a message. `has_asset` is whether a scene of the farm has an asset.
    ///
    /// # Errors
    /// A message beyond the budget.
    pub(crate) fn count(
        &mut self,
        message: &ToMaster,
        has_asset: impl Fn(AssetId) -> bool,
        now: Instant,
    ) -> Result<(), OverBudget> {
        if matches!(message, ToMaster::Pixels { .. }) {
            return Ok(());
        }
        within(self.messages.take(now), OverBudget::Messages)?;
        match message {
            ToMaster::Failed { .. } => within(self.failures.take(now), OverBudget::Failures),
            ToMaster::NeedAsset { id, .. } if has_asset(*id) => {
                let (requests, _) = self.assets.entry(*id).or_default();
                *requests += 1;
                within(*requests <= REQUESTS_OF_ASSET, OverBudget::Requests)
            }
            ToMaster::NeedAsset { .. } => {
                self.unknown += 1;
                within(self.unknown <= MAX_UNKNOWN, OverBudget::Unknown)
            }
            // Its scene may have been replaced while it was in transfer.
            ToMaster::HaveAsset { id } if !has_asset(*id) => Ok(()),
            ToMaster::HaveAsset { id } => {
                let (requests, reports) = self.assets.get_mut(id).ok_or(OverBudget::Reports)?;
                *reports += 1;
                within(reports <= requests, OverBudget::Reports)
            }
            _ => Ok(()),
        }
    }
}

fn within(is_within: bool, error: OverBudget) -> Result<(), OverBudget> {
    if is_within { Ok(()) } else { Err(error) }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use rayfarm_protocol::FrameId;

    use super::*;

    fn any(_: AssetId) -> bool {
        true
    }

    #[test]
    fn a_flood_ends_and_a_steady_rate_does_not() {
        let start = Instant::now();
        let mut budget = Budget::new(start);
        let pong = ToMaster::Pong { nonce: 0, progressed: false };
        let flood = (0..).take_while(|_| budget.count(&pong, any, start).is_ok()).take(100_000).count();
        assert_eq!(flood as f64, MESSAGES.burst);
        assert_eq!(budget.count(&pong, any, start), Err(OverBudget::Messages));
        for step in 1..10_000 {
            let now = start + Duration::from_millis(10 * step);
            assert_eq!(budget.count(&pong, any, now), Ok(()), "100 a second");
        }
    }

    #[test]
    fn failures_and_requests_have_bounds_of_their_own() {
        let now = Instant::now();
        let mut budget = Budget::new(now);
        let failed = ToMaster::Failed { frame: FrameId(1), reason: "no".to_owned() };
        let flood = (0..).take_while(|_| budget.count(&failed, any, now).is_ok()).take(100_000).count();
        assert_eq!(flood as f64, FAILURES.burst);
        let need = |byte| ToMaster::NeedAsset { id: AssetId([byte; 32]), offset: 0, again: true };
        for _ in 0..REQUESTS_OF_ASSET {
            assert_eq!(budget.count(&need(1), any, now), Ok(()));
        }
        assert_eq!(budget.count(&need(1), any, now), Err(OverBudget::Requests));
        assert_eq!(budget.count(&need(2), any, now), Ok(()));
    }

    #[test]
    fn unknown_assets_take_no_memory_and_are_bounded() {
        let now = Instant::now();
        let mut budget = Budget::new(now);
        for number in 0..MAX_UNKNOWN {
            let need = ToMaster::NeedAsset { id: AssetId([number as u8; 32]), offset: 0, again: false };
            assert_eq!(budget.count(&need, |_| false, now), Ok(()));
        }
        let need = ToMaster::NeedAsset { id: AssetId([200; 32]), offset: 0, again: false };
        assert_eq!(budget.count(&need, |_| false, now), Err(OverBudget::Unknown));
        assert!(budget.assets.is_empty());
    }

    #[test]
    fn counts_begin_again_when_the_scene_is_replaced() {
        let now = Instant::now();
        let mut budget = Budget::new(now);
        let id = AssetId([1; 32]);
        let (need, have) = (ToMaster::NeedAsset { id, offset: 0, again: false }, ToMaster::HaveAsset { id });
        for _ in 0..3 {
            (0..REQUESTS_OF_ASSET - 1).for_each(|_| assert_eq!(budget.count(&need, any, now), Ok(())));
            budget.scene_replaced(any);
        }
        assert_eq!(budget.count(&have, any, now), Ok(()), "a request is open");
        assert_eq!(budget.count(&have, any, now), Err(OverBudget::Reports));
        assert_eq!(budget.count(&have, |_| false, now), Ok(()), "no scene has it any more");
        budget.scene_replaced(|_| false);
        assert!(budget.assets.is_empty());
        (0..MAX_UNKNOWN).for_each(|_| assert_eq!(budget.count(&need, |_| false, now), Ok(())));
        budget.scene_replaced(any);
        assert_eq!(budget.count(&need, |_| false, now), Ok(()));
    }

    #[test]
    fn an_asset_is_reported_as_often_as_it_is_requested() {
        let now = Instant::now();
        let mut budget = Budget::new(now);
        let id = AssetId([1; 32]);
        let (need, have) = (ToMaster::NeedAsset { id, offset: 0, again: false }, ToMaster::HaveAsset { id });
        assert_eq!(budget.count(&have, any, now), Err(OverBudget::Reports));
        for _ in 0..2 {
            assert_eq!(budget.count(&need, any, now), Ok(()));
            assert_eq!(budget.count(&have, any, now), Ok(()));
            assert_eq!(budget.count(&have, any, now), Err(OverBudget::Reports));
            // The refused report is counted, so one more request makes up for it.
            assert_eq!(budget.count(&need, any, now), Ok(()));
        }
    }
}
