//! The frames that the master has announced and not cancelled, and the leases that wait for them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use rayfarm_protocol::{AssetId, FrameAnnounce, FrameId, Lease, PixelFormat};

use crate::wanted::{Claim, Wanted};

/// Frames that are held at a time. A master has two in flight; those that it spoke of longest ago give way. That need
/// not be the oldest: while one frame takes its time, many of those after it may be replaced by newer ones.
const MAX_FRAMES: usize = 8;

/// Leases of one frame that wait for it to get ready.
const MAX_WAITING: usize = 4096;

/// How far a frame is.
enum State<F> {
    /// Its scene is being loaded.
    Loading,
    /// It is being prepared on a blocking thread.
    Preparing,
    /// Leases can be rendered.
    Ready(Arc<F>),
    /// None will be; the master knows.
    Failed,
}

struct Held<F> {
    announce: FrameAnnounce,
    /// How many announcements had come when it was announced last.
    spoken_of: u64,
    state: State<F>,
    /// On what is prepared for it.
    claim: Claim,
    /// With the moment of their arrival.
    waiting: Vec<(Lease, Instant)>,
}

/// What to do with a lease.
#[derive(Debug)]
pub(crate) enum Verdict<F> {
    /// Render these rows.
    Render(Range<u32>, Arc<F>),
    /// Nothing now: it waits, or is stale, or its frame has failed.
    Nothing,
    /// It can never be rendered, and the master must be told.
    Refuse(String),
}

/// Announced frames by number.
pub(crate) struct Frames<F> {
    held: BTreeMap<FrameId, Held<F>>,
    /// Nothing before this one is wanted.
    before: FrameId,
    /// Announcements so far.
    announcements: u64,
}

impl<F> Frames<F> {
    pub(crate) fn new() -> Self {
        Self { held: BTreeMap::new(), before: FrameId(0), announcements: 0 }
    }

    /// Takes a new frame in; `false` when it is known. At most one other frame gives way and is returned.
    /// A frame that has failed begins anew: the master announces it again when it tries this worker again. So does one that
    /// was cancelled: the master has rows of it verified.
    pub(crate) fn announce(&mut self, announce: FrameAnnounce) -> (bool, Option<FrameId>) {
        let frame = announce.frame;
        self.announcements += 1;
        let spoken_of = self.announcements;
        let known = self.held.get_mut(&frame).filter(|held| !matches!(held.state, State::Failed));
        if let Some(held) = known {
            held.spoken_of = spoken_of;
            return (false, None);
        }
        let (state, claim) = (State::Loading, Claim::default());
        self.held.insert(frame, Held { announce, spoken_of, state, claim, waiting: Vec::new() });
        let too_many = self.held.len() > MAX_FRAMES;
        let longest_ago = self.held.iter().min_by_key(|(_, held)| held.spoken_of).filter(|_| too_many);
        let dropped = longest_ago.map(|(&frame, _)| frame);
        dropped.iter().for_each(|frame| drop(self.held.remove(frame)));
        (true, dropped)
    }

    /// The scenes of all frames held.
    pub(crate) fn scenes(&self) -> BTreeSet<AssetId> {
        self.held.values().map(|held| held.announce.scene).collect()
    }

    pub(crate) fn cancel(&mut self, before: FrameId) {
        self.before = self.before.max(before);
        self.held = self.held.split_off(&self.before);
    }

    /// The scene is there: the frames that waited for it are to be prepared.
    pub(crate) fn scene_ready(&mut self, scene: AssetId) -> Vec<(FrameAnnounce, Wanted)> {
        let waiting = self.loading(scene);
        waiting
            .map(|held| {
                held.state = State::Preparing;
                (held.announce.clone(), held.claim.wanted())
            })
            .collect()
    }

    /// The scene will not be there: these frames have failed.
    pub(crate) fn scene_failed(&mut self, scene: AssetId) -> Vec<FrameId> {
        self.loading(scene).map(|held| held.fail()).collect()
    }

    fn loading(&mut self, scene: AssetId) -> impl Iterator<Item = &mut Held<F>> {
        let is_hit =
            move |held: &&mut Held<F>| held.announce.scene == scene && matches!(held.state, State::Loading);
        self.held.values_mut().filter(is_hit)
    }

    /// A frame is ready: the leases that waited for it.
    pub(crate) fn ready(&mut self, frame: FrameId, ready: F) -> Vec<(Lease, Instant)> {
        let held = self.held.get_mut(&frame).filter(|held| matches!(held.state, State::Preparing));
        let Some(held) = held else { return Vec::new() };
        held.state = State::Ready(Arc::new(ready));
        std::mem::take(&mut held.waiting)
    }

    /// A frame has failed; `true` when the master does not know yet.
    pub(crate) fn failed(&mut self, frame: FrameId) -> bool {
        let held = self.held.get_mut(&frame);
        held.filter(|held| !matches!(held.state, State::Failed)).map(|held| held.fail()).is_some()
    }

    /// Decides on a lease that has arrived at that moment.
    pub(crate) fn lease(&mut self, lease: Lease, arrived: Instant) -> Verdict<F> {
        let Some(held) = self.held.get_mut(&lease.frame) else {
            if lease.frame < self.before {
                return Verdict::Nothing;
            }
            return Verdict::Refuse(format!("{lease} is of a frame that this worker does not hold"));
        };
        let FrameAnnounce { width, height, .. } = held.announce;
        let Some(rows) = lease.rows().filter(|rows| rows.end <= height) else {
            return Verdict::Refuse(format!("{lease} lies outside a frame of {height} rows"));
        };
        if PixelFormat::SEGMENT.segment_bytes(width, lease.row_count).is_none() {
            return Verdict::Refuse(format!("{lease} has more pixels than fit into one message"));
        }
        match &held.state {
            State::Ready(frame) => Verdict::Render(rows, Arc::clone(frame)),
            State::Failed => Verdict::Nothing,
            State::Loading | State::Preparing if held.waiting.len() >= MAX_WAITING => {
                Verdict::Refuse(format!("more than {MAX_WAITING} leases wait for frame {}", lease.frame))
            }
            State::Loading | State::Preparing => {
                held.waiting.push((lease, arrived));
                Verdict::Nothing
            }
        }
    }

    /// Whether any lease waits for its frame.
    pub(crate) fn has_waiting(&self) -> bool {
        self.held.values().any(|held| !held.waiting.is_empty())
    }
}

impl<F> Held<F> {
    fn fail(&mut self) -> FrameId {
        self.state = State::Failed;
        self.waiting.clear();
        self.announce.frame
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;

    fn announce(frame: u64) -> FrameAnnounce {
        let scene = AssetId([7; 32]);
        FrameAnnounce { frame: FrameId(frame), scene, width: 8, height: 8, view: Bytes::new() }
    }

    fn is_refused(frames: &mut Frames<()>, frame: u64) -> bool {
        let lease = Lease { frame: FrameId(frame), segment: 0, attempt: 0, first_row: 0, row_count: 8 };
        matches!(frames.lease(lease, Instant::now()), Verdict::Refuse(_))
    }

    #[test]
    fn a_frame_that_takes_its_time_outlives_many_that_were_replaced() {
        let mut frames = Frames::new();
        for newer in 6..60 {
            // So does the master: it speaks of a frame again before it leases rows of it, if two others came between.
            frames.announce(announce(5));
            frames.announce(announce(newer));
            frames.announce(announce(newer + 1));
            assert!(!is_refused(&mut frames, 5) && !is_refused(&mut frames, newer + 1), "frame {newer}");
            assert!(frames.held.len() <= MAX_FRAMES);
        }
    }

    #[test]
    fn what_was_not_spoken_of_for_longest_gives_way() {
        let mut frames = Frames::<()>::new();
        (0..MAX_FRAMES as u64).for_each(|frame| assert!(frames.announce(announce(frame)).0));
        assert_eq!(frames.announce(announce(0)), (false, None));
        assert_eq!(frames.announce(announce(100)), (true, Some(FrameId(1))));
        assert!(is_refused(&mut frames, 1) && !is_refused(&mut frames, 0));
    }
}
