//! What rows that are to be verified look like: hashes of what was sent, and of which frame they are.

use std::collections::BTreeMap;

use blake3::Hash;
use rayfarm_protocol::{FrameAnnounce, FrameId, Lease};
use rayfarm_tracer::scene::FrameView;

use rayfarm_scheduler::{Finding, WorkerId};

/// Rows that are verified.
#[derive(Clone, Debug)]
pub(crate) struct Seal {
    pub(crate) lease: Lease,
    pub(crate) view: FrameView,
    pub(crate) announce: FrameAnnounce,
    pub(crate) painter: Signed,
    /// Whoever has sent other bytes last.
    pub(crate) checker: Option<Signed>,
}

/// Bytes, and whose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Signed {
    pub(crate) worker: WorkerId,
    pub(crate) hash: Hash,
}

/// The seals of all open audits: the scheduler bounds how many.
#[derive(Debug, Default)]
pub(crate) struct Seals(BTreeMap<(FrameId, u32), Seal>);

impl Seals {
    pub(crate) fn add(&mut self, seal: Seal) {
        self.0.insert((seal.lease.frame, seal.lease.segment), seal);
    }

    pub(crate) fn get(&self, frame: FrameId, segment: u32) -> Option<&Seal> {
        self.0.get(&(frame, segment))
    }

    pub(crate) fn remove(&mut self, frame: FrameId, segment: u32) {
        self.0.remove(&(frame, segment));
    }

    /// A frame of which rows are sealed.
    pub(crate) fn announce(&self, frame: FrameId) -> Option<&FrameAnnounce> {
        self.0.range((frame, 0)..=(frame, u32::MAX)).next().map(|(_, seal)| &seal.announce)
    }

    /// Compares what a worker has sent now with what was sent before.
    pub(crate) fn compare(&mut self, lease: &Lease, now: Signed) -> Finding {
        let Some(seal) = self.0.get_mut(&(lease.frame, lease.segment)) else { return Finding::Unknown };
        if seal.painter.hash == now.hash {
            return Finding::Same;
        }
        // The latest counts: an earlier one may have come from somebody who no longer held the lease, and whoever is judged
        // is judged at once.
        seal.checker = Some(now);
        let (painter, checker) = (seal.painter.worker, now.worker);
        tracing::warn!(
            "{painter} and {checker} have sent different pixels of {lease}: the master traces them itself"
        );
        Finding::Different
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use rayfarm_protocol::AssetId;

    use super::*;
    use crate::testing::test_scene::view;

    fn signed(worker: u64) -> Signed {
        Signed { worker: WorkerId(worker), hash: blake3::hash(&worker.to_le_bytes()) }
    }

    #[test]
    fn the_one_who_answered_last_is_judged() {
        let lease = Lease { frame: FrameId(1), segment: 0, attempt: 0, first_row: 0, row_count: 1 };
        let (frame, scene) = (lease.frame, AssetId([0; 32]));
        let announce = FrameAnnounce { frame, scene, width: 1, height: 1, view: Bytes::new() };
        let mut seals = Seals::default();
        seals.add(Seal { lease, view: view(), announce, painter: signed(1), checker: None });
        assert_eq!(seals.compare(&lease, Signed { worker: WorkerId(2), ..signed(1) }), Finding::Same);
        for checker in [3, 4] {
            assert_eq!(seals.compare(&lease, signed(checker)), Finding::Different);
            assert_eq!(seals.get(frame, 0).and_then(|seal| seal.checker).unwrap().worker, WorkerId(checker));
        }
    }
}
