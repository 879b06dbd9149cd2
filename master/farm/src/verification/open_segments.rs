//! Segments that are being verified, with the digest of each rendering.

use std::collections::BTreeMap;

use rayfarm_protocol::{AssetId, FrameAnnounce, FrameId, Lease};
use rayfarm_scheduler::{Finding, WorkerId};
use rayfarm_tracer::scene::FrameView;

use super::SegmentDigest;

/// A segment that is being verified.
#[derive(Clone, Debug)]
pub(crate) struct OpenSegment {
    pub(crate) lease: Lease,
    pub(crate) view: FrameView,
    /// The announcement of its frame, for a worker that renders it a second time after the frame is complete.
    pub(crate) announce: FrameAnnounce,
    /// The rendering in the picture.
    pub(crate) first: Rendering,
    /// The last rendering that differs from the first.
    pub(crate) second: Option<Rendering>,
}

/// The digest of a worker's rendering.
#[derive(Clone, Debug)]
pub(crate) struct Rendering {
    pub(crate) worker: WorkerId,
    pub(crate) digest: SegmentDigest,
}

/// All segments that are being verified. The scheduler bounds their number.
#[derive(Debug, Default)]
pub(crate) struct OpenSegments(BTreeMap<(FrameId, u32), OpenSegment>);

impl OpenSegments {
    pub(crate) fn insert(&mut self, segment: OpenSegment) {
        self.0.insert((segment.lease.frame, segment.lease.segment), segment);
    }

    pub(crate) fn get(&self, frame: FrameId, segment: u32) -> Option<&OpenSegment> {
        self.0.get(&(frame, segment))
    }

    pub(crate) fn remove(&mut self, frame: FrameId, segment: u32) {
        self.0.remove(&(frame, segment));
    }

    /// The announcement of a frame that has open segments.
    pub(crate) fn announce(&self, frame: FrameId) -> Option<&FrameAnnounce> {
        self.0.range((frame, 0)..=(frame, u32::MAX)).next().map(|(_, segment)| &segment.announce)
    }

    /// The scenes of all frames with open segments.
    pub(crate) fn scenes(&self) -> impl Iterator<Item = AssetId> {
        self.0.values().map(|segment| segment.announce.scene)
    }

    /// Compares a second rendering with the first. Both digests should be computed before, outside of locks.
    pub(crate) fn compare(&mut self, lease: &Lease, second: Rendering) -> Finding {
        let Some(segment) = self.0.get_mut(&(lease.frame, lease.segment)) else { return Finding::Unknown };
        if segment.first.digest == second.digest {
            return Finding::Same;
        }
        // A dispute is settled at once, so an earlier second rendering comes from a worker that had lost its lease: the
        // latest one counts.
        let (first, other) = (segment.first.worker, second.worker);
        segment.second = Some(second);
        tracing::warn!("{first} and {other} have sent different pixels of {lease}");
        Finding::Different
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use rayfarm_protocol::PixelFormat;

    use super::*;
    use crate::testing::test_scene::view;

    fn rendering(worker: u64) -> Rendering {
        Rendering { worker: WorkerId(worker), digest: SegmentDigest::of(worker.to_le_bytes().to_vec()) }
    }

    #[test]
    fn the_latest_second_rendering_counts() {
        let lease = Lease { frame: FrameId(1), segment: 0, attempt: 0, first_row: 0, row_count: 1 };
        let (frame, scene) = (lease.frame, AssetId([0; 32]));
        let announce = FrameAnnounce {
            frame,
            scene,
            width: 1,
            height: 1,
            format: PixelFormat::Rgb8,
            view: Bytes::new(),
        };
        let mut open = OpenSegments::default();
        open.insert(OpenSegment { lease, view: view(), announce, first: rendering(1), second: None });
        assert_eq!(open.compare(&lease, Rendering { worker: WorkerId(2), ..rendering(1) }), Finding::Same);
        for second in [3, 4] {
            assert_eq!(open.compare(&lease, rendering(second)), Finding::Different);
            assert_eq!(
                open.get(frame, 0).and_then(|open| open.second.as_ref()).unwrap().worker,
                WorkerId(second)
            );
        }
    }
}
