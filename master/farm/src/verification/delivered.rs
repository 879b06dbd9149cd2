//! Finished frames by the workers whose rows they have, to list the frames that may be wrong when a worker is found to have
//! sent wrong pixels.

use std::collections::BTreeMap;
use std::ops::Range;

use rayfarm_protocol::FrameId;
use rayfarm_scheduler::WorkerId;

/// Workers whose frames are remembered; beyond that, the frames of the lowest number are dropped.
const MAX_WORKERS: usize = 65_536;
/// Runs of frames in one set.
const MAX_RUNS: usize = 4096;

/// A set of frame numbers, stored as runs in ascending order. Above 4096 runs, the two with the smallest gap are joined:
/// the set then has frames too many, but never too few.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameSet(Vec<Range<u64>>);

impl FrameSet {
    fn add(&mut self, run: Range<u64>) {
        let first = self.0.partition_point(|known| known.end < run.start);
        let end = self.0.partition_point(|known| known.start <= run.end);
        let met = self.0.get(first..end).unwrap_or_default();
        let start = met.first().map_or(run.start, |known| known.start.min(run.start));
        let stop = met.last().map_or(run.end, |known| known.end.max(run.end));
        drop(self.0.splice(first..end, std::iter::once(start..stop)));
        if self.0.len() > MAX_RUNS {
            self.join_closest();
        }
    }

    fn join_closest(&mut self) {
        let gaps = self.0.windows(2).enumerate().filter_map(|(index, pair)| match pair {
            [one, next] => Some((next.start - one.end, index)),
            _ => None,
        });
        let Some((_, index)) = gaps.min() else { return };
        let next = self.0.remove(index + 1);
        if let Some(one) = self.0.get_mut(index) {
            one.end = next.end;
        }
    }

    /// Whether a frame is in the set.
    pub fn contains(&self, frame: FrameId) -> bool {
        let at = self.0.partition_point(|run| run.end <= frame.0);
        self.0.get(at).is_some_and(|run| run.contains(&frame.0))
    }

    /// Number of frames in the set.
    pub fn count(&self) -> u64 {
        self.0.iter().map(|run| run.end - run.start).sum()
    }

    /// The runs in ascending order, as the first and the last frame of each.
    pub fn runs(&self) -> impl Iterator<Item = (u64, u64)> {
        self.0.iter().map(|run| (run.start, run.end - 1))
    }
}

/// Runs of frame numbers as text: `3, 7 to 9`.
pub fn as_text(runs: impl IntoIterator<Item = (u64, u64)>) -> String {
    const SHOWN: usize = 20;
    let mut runs = runs.into_iter();
    let one = |(first, last): (u64, u64)| match last - first {
        0 => first.to_string(),
        1 => format!("{first}, {last}"),
        _ => format!("{first} to {last}"),
    };
    let mut text = runs.by_ref().take(SHOWN).map(one).collect::<Vec<_>>().join(", ");
    let left = runs.count();
    if left > 0 {
        text += &format!(" and {left} more runs of frames");
    }
    text
}

/// All finished frames, by worker.
#[derive(Debug, Default)]
pub(crate) struct Delivered {
    by_worker: BTreeMap<WorkerId, FrameSet>,
    wrong: FrameSet,
}

impl Delivered {
    /// Adds a finished frame that has rows of these workers.
    pub(crate) fn add(&mut self, frame: FrameId, workers: impl IntoIterator<Item = WorkerId>) {
        for worker in workers {
            self.by_worker.entry(worker).or_default().add(frame.0..frame.0.saturating_add(1));
        }
        while self.by_worker.len() > MAX_WORKERS {
            self.by_worker.pop_first();
        }
    }

    /// Marks the frames of a worker as possibly wrong. Returns these frames.
    pub(crate) fn mark_wrong(&mut self, worker: WorkerId) -> FrameSet {
        let frames = self.by_worker.remove(&worker).unwrap_or_default();
        frames.0.iter().for_each(|run| self.wrong.add(run.clone()));
        frames
    }

    /// All frames that may be wrong.
    pub(crate) fn wrong(&self) -> &FrameSet {
        &self.wrong
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn runs_are_joined_in_the_text() {
        assert_eq!(as_text([(3, 3), (5, 6), (8, 11)]), "3, 5, 6, 8 to 11");
        let many = as_text((0..25).map(|n| (10 * n, 10 * n)));
        assert!(many.starts_with("0, 10, 20") && many.ends_with("190 and 5 more runs of frames"), "{many}");
    }

    #[test]
    fn only_the_frames_of_a_marked_worker_are_wrong() {
        let mut delivered = Delivered::default();
        let [one, other] = [WorkerId(1), WorkerId(2)];
        for (frame, workers) in [(1, vec![one]), (2, vec![one, other]), (3, vec![other]), (5, vec![one])] {
            delivered.add(FrameId(frame), workers);
        }
        assert_eq!(delivered.mark_wrong(one).runs().collect::<Vec<_>>(), [(1, 2), (5, 5)]);
        let wrong: Vec<u64> = (0..7).filter(|&frame| delivered.wrong().contains(FrameId(frame))).collect();
        assert_eq!((wrong, delivered.wrong().count()), (vec![1, 2, 5], 3));
        assert_eq!(delivered.mark_wrong(one).count(), 0);
    }

    #[test]
    fn joined_runs_lose_no_frame() {
        let mut set = FrameSet::default();
        let frames = || (0..2 * MAX_RUNS as u64).map(|n| 3 * n);
        frames().for_each(|frame| set.add(frame..frame + 1));
        assert_eq!(set.0.len(), MAX_RUNS);
        assert!(frames().all(|frame| set.contains(FrameId(frame))));
    }

    proptest! {
        #[test]
        fn a_set_contains_what_was_added(frames in prop::collection::vec(0_u64..60, 0..80)) {
            let mut set = FrameSet::default();
            frames.iter().for_each(|&frame| set.add(frame..frame + 1));
            let expected: BTreeSet<u64> = frames.into_iter().collect();
            for frame in 0..62 {
                prop_assert_eq!(set.contains(FrameId(frame)), expected.contains(&frame));
            }
            prop_assert_eq!(set.count(), expected.len() as u64);
            prop_assert!(set.0.is_sorted_by(|a, b| a.end < b.start));
        }
    }
}
