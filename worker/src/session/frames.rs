//! Announced frames of a session, and the leases that wait for them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use rayfarm_protocol::limits::MAX_PIXELS_BYTES;
use rayfarm_protocol::{AssetId, FrameAnnounce, FrameId, Lease};

use crate::cancel::{CancelFlag, CancelGuard};

/// Most frames at a time. A master has two frames in flight. The least recently announced frame is dropped first, which
/// need not be the oldest: while one frame is slow, newer ones may replace many of those after it.
const MAX_FRAMES: usize = 8;

/// Most leases that wait for one frame.
const MAX_WAITING: usize = 4096;

/// State of a frame.
enum State<F> {
    /// Its scene is being loaded.
    Loading,
    /// It is being prepared on a blocking thread.
    Preparing,
    /// Its leases can be rendered.
    Ready(Arc<F>),
    /// It failed, and the master has received a report.
    Failed,
}

struct Entry<F> {
    announce: FrameAnnounce,
    /// Number of the frame's last announcement, in order of arrival.
    last_announced: u64,
    state: State<F>,
    /// Cancels the preparation when the frame is dropped.
    cancel: CancelGuard,
    /// Leases that wait for the frame, with the time of their arrival.
    waiting: Vec<(Lease, Instant)>,
}

/// Decision about a lease.
#[derive(Debug)]
pub(super) enum LeaseDecision<F> {
    /// Render these rows.
    Render(Range<u32>, Arc<F>),
    /// Do nothing: the lease waits for its frame, is stale, or its frame has failed.
    None,
    /// Report to the master that the lease cannot be rendered, for this reason.
    Refuse(String),
}

/// Announced frames by number.
pub(super) struct FrameTable<F> {
    frames: BTreeMap<FrameId, Entry<F>>,
    /// Frames before this one are cancelled.
    cancelled_before: FrameId,
    /// Number of announcements so far.
    announcements: u64,
    /// Largest pixels of a lease, in bytes.
    max_segment_bytes: usize,
}

impl<F> FrameTable<F> {
    pub(super) fn new() -> Self {
        Self {
            frames: BTreeMap::new(),
            cancelled_before: FrameId(0),
            announcements: 0,
            max_segment_bytes: MAX_PIXELS_BYTES,
        }
    }

    /// Refuses leases with more than `bytes` of pixels.
    pub(super) fn limit_segments(&mut self, bytes: usize) {
        self.max_segment_bytes = bytes.min(MAX_PIXELS_BYTES);
    }

    /// Handles an announcement. Returns whether the frame is new, and the frame that was dropped for it, if any.
    ///
    /// A failed frame is new when it is announced again: the master retries it on this worker. So is a cancelled one: the
    /// master leases rows of it for verification.
    pub(super) fn announce(&mut self, announce: FrameAnnounce) -> (bool, Option<FrameId>) {
        let frame = announce.frame;
        self.announcements += 1;
        let last_announced = self.announcements;
        let known = self.frames.get_mut(&frame).filter(|entry| !matches!(entry.state, State::Failed));
        if let Some(entry) = known {
            entry.last_announced = last_announced;
            return (false, None);
        }
        let (state, cancel) = (State::Loading, CancelGuard::default());
        self.frames.insert(frame, Entry { announce, last_announced, state, cancel, waiting: Vec::new() });
        let too_many = self.frames.len() > MAX_FRAMES;
        let least_recent = self.frames.iter().min_by_key(|(_, entry)| entry.last_announced);
        let dropped = least_recent.filter(|_| too_many).map(|(&frame, _)| frame);
        dropped.iter().for_each(|frame| drop(self.frames.remove(frame)));
        (true, dropped)
    }

    /// Returns the scenes of all frames.
    pub(super) fn scenes(&self) -> BTreeSet<AssetId> {
        self.frames.values().map(|entry| entry.announce.scene).collect()
    }

    /// Drops all frames before a given one.
    pub(super) fn cancel_before(&mut self, before: FrameId) {
        self.cancelled_before = self.cancelled_before.max(before);
        self.frames = self.frames.split_off(&self.cancelled_before);
    }

    /// Handles a loaded scene. Returns its frames, which are to be prepared now.
    pub(super) fn scene_ready(&mut self, scene: AssetId) -> Vec<(FrameAnnounce, CancelFlag)> {
        let waiting = self.loading(scene);
        waiting
            .map(|entry| {
                entry.state = State::Preparing;
                (entry.announce.clone(), entry.cancel.flag())
            })
            .collect()
    }

    /// Fails the frames of a scene that cannot be loaded, and returns them.
    pub(super) fn scene_failed(&mut self, scene: AssetId) -> Vec<FrameId> {
        self.loading(scene).map(|entry| entry.fail()).collect()
    }

    fn loading(&mut self, scene: AssetId) -> impl Iterator<Item = &mut Entry<F>> {
        self.frames
            .values_mut()
            .filter(move |entry| entry.announce.scene == scene && matches!(entry.state, State::Loading))
    }

    /// Sets a prepared frame, and returns the leases that waited for it.
    pub(super) fn set_ready(&mut self, frame: FrameId, ready: F) -> Vec<(Lease, Instant)> {
        let entry = self.frames.get_mut(&frame).filter(|entry| matches!(entry.state, State::Preparing));
        let Some(entry) = entry else { return Vec::new() };
        entry.state = State::Ready(Arc::new(ready));
        std::mem::take(&mut entry.waiting)
    }

    /// Fails a frame. Returns whether the master has no report about it yet.
    pub(super) fn fail(&mut self, frame: FrameId) -> bool {
        let entry = self.frames.get_mut(&frame);
        entry.filter(|entry| !matches!(entry.state, State::Failed)).map(|entry| entry.fail()).is_some()
    }

    /// Decides about a lease that arrived at a given time.
    pub(super) fn lease(&mut self, lease: Lease, arrived: Instant) -> LeaseDecision<F> {
        let Some(entry) = self.frames.get_mut(&lease.frame) else {
            if lease.frame < self.cancelled_before {
                return LeaseDecision::None;
            }
            return LeaseDecision::Refuse(format!("{lease}: the frame is not announced"));
        };
        let FrameAnnounce { width, height, format, .. } = entry.announce;
        let Some(rows) = lease.rows().filter(|rows| rows.end <= height) else {
            return LeaseDecision::Refuse(format!("{lease}: the rows are outside a frame of {height} rows"));
        };
        match format.segment_bytes(width, lease.row_count) {
            Some(bytes) if bytes <= self.max_segment_bytes => {}
            Some(bytes) => {
                return LeaseDecision::Refuse(format!(
                    "{lease}: its pixels have {bytes} bytes, at most {} fit into this worker's --memory",
                    self.max_segment_bytes
                ));
            }
            None => return LeaseDecision::Refuse(format!("{lease}: the pixels do not fit into one message")),
        }
        match &entry.state {
            State::Ready(frame) => LeaseDecision::Render(rows, Arc::clone(frame)),
            State::Failed => LeaseDecision::None,
            State::Loading | State::Preparing if entry.waiting.len() >= MAX_WAITING => LeaseDecision::Refuse(
                format!("more than {MAX_WAITING} leases wait for frame {}", lease.frame),
            ),
            State::Loading | State::Preparing => {
                entry.waiting.push((lease, arrived));
                LeaseDecision::None
            }
        }
    }

    /// Whether any lease waits for its frame.
    pub(super) fn has_waiting_leases(&self) -> bool {
        self.frames.values().any(|entry| !entry.waiting.is_empty())
    }
}

impl<F> Entry<F> {
    fn fail(&mut self) -> FrameId {
        self.state = State::Failed;
        self.waiting.clear();
        self.announce.frame
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use rayfarm_protocol::PixelFormat;
    use rayfarm_protocol::limits::MAX_FRAME_SIDE;

    use super::*;

    fn announce(frame: u64) -> FrameAnnounce {
        let (scene, format) = (AssetId([7; 32]), PixelFormat::Rgb8);
        FrameAnnounce { frame: FrameId(frame), scene, width: 8, height: 8, format, view: Bytes::new() }
    }

    fn is_refused(frames: &mut FrameTable<()>, frame: u64) -> bool {
        let lease = Lease { frame: FrameId(frame), segment: 0, attempt: 0, first_row: 0, row_count: 8 };
        matches!(frames.lease(lease, Instant::now()), LeaseDecision::Refuse(_))
    }

    #[test]
    fn a_slow_frame_outlives_many_replaced_frames() {
        let mut frames = FrameTable::new();
        for newer in 6..60 {
            // The master announces a frame again before a lease of it, where it has announced two others since.
            frames.announce(announce(5));
            frames.announce(announce(newer));
            frames.announce(announce(newer + 1));
            assert!(!is_refused(&mut frames, 5) && !is_refused(&mut frames, newer + 1), "frame {newer}");
            assert!(frames.frames.len() <= MAX_FRAMES);
        }
    }

    #[test]
    fn a_lease_whose_pixels_do_not_fit_into_a_message_is_refused() {
        for format in PixelFormat::ALL {
            let mut frames = FrameTable::<()>::new();
            frames.announce(FrameAnnounce { width: 1 << 14, height: MAX_FRAME_SIDE, format, ..announce(1) });
            let most = (MAX_PIXELS_BYTES / format.row_bytes(1 << 14)) as u32;
            for (row_count, refused) in [(most, false), (most + 1, true)] {
                let lease = Lease { frame: FrameId(1), segment: 0, attempt: 0, first_row: 0, row_count };
                let decision = frames.lease(lease, Instant::now());
                assert_eq!(matches!(decision, LeaseDecision::Refuse(_)), refused, "{format:?}: {decision:?}");
            }
        }
    }

    #[test]
    fn a_lease_above_the_worker_s_own_bound_is_refused_with_the_bound() {
        let mut frames = FrameTable::<()>::new();
        frames.limit_segments(8 * 3 * 5);
        frames.announce(announce(1));
        for (row_count, refused) in [(5, false), (6, true)] {
            let lease = Lease { frame: FrameId(1), segment: 0, attempt: 0, first_row: 0, row_count };
            match frames.lease(lease, Instant::now()) {
                LeaseDecision::Refuse(reason) => {
                    assert!(refused && reason.contains("144 bytes") && reason.contains("120"), "{reason}");
                }
                decision => assert!(!refused, "{decision:?}"),
            }
        }
    }

    #[test]
    fn the_least_recently_announced_frame_is_dropped() {
        let mut frames = FrameTable::<()>::new();
        (0..MAX_FRAMES as u64).for_each(|frame| assert!(frames.announce(announce(frame)).0));
        assert_eq!(frames.announce(announce(0)), (false, None));
        assert_eq!(frames.announce(announce(100)), (true, Some(FrameId(1))));
        assert!(is_refused(&mut frames, 1) && !is_refused(&mut frames, 0));
    }
}
