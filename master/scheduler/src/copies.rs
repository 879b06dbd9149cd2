//! Rendering a segment twice: when that is predicted to finish a frame earlier, and nothing else is to be done.

use std::time::Duration;

use super::adaptive::{Crew, seconds};
use super::worker::Worker;
use super::{FrameId, Lease, Scheduler, WorkerId};

/// Workers that render the same segment at most...
const MAX_COPIES: usize = 3;
/// ...not counting those that have had it for longer than this: they may answer pings and nothing else for ever...
const TRUSTED_FOR: Duration = Duration::from_secs(10);
/// ...nor, for longer than this, those that have not yet answered anything: they may be fetching the scene over a slow link. To
/// a worker that has, these do not count at all.
const NEWCOMER_TRUSTED_FOR: Duration = Duration::from_secs(1);

/// A segment that others render.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    frame: FrameId,
    segment: u32,
    copies: usize,
}

impl Scheduler {
    /// The seed's rule: the oldest segment that the fewest render, at once.
    pub(super) fn any_copy(&mut self, now: Duration, id: WorkerId) -> Option<Lease> {
        let best = self.copyable(now, id).min_by_key(|known| (known.frame, known.copies, known.segment))?;
        self.frames.iter_mut().find(|known| known.id == best.frame)?.copy(best.segment, id)
    }

    /// Rows of the oldest frame that nobody renders but workers of whom nothing has come yet: who is known goes before the next frame
    /// for them, because nobody knows whether they will be rendered. In the first frame all are new.
    pub(super) fn give_newcomers_rows(&mut self, now: Duration, id: WorkerId, crew: &mut Crew) -> bool {
        let is_known = |worker: &Worker| worker.segments_done > 0;
        if self.last_frame == Duration::ZERO || self.workers.values().all(is_known) {
            return false;
        }
        let oldest = self.frames.front().map(|frame| frame.id);
        let Some(oldest) = oldest.filter(|_| self.workers.get(&id).is_some_and(is_known)) else {
            return false;
        };
        let unsure = |known: &Candidate| known.frame == oldest && known.copies == 0;
        let Some(Candidate { segment, .. }) = self.copyable(now, id).find(unsure) else { return false };
        let lease = self.frames.front_mut().and_then(|frame| frame.copy(segment, id));
        lease.into_iter().for_each(|lease| self.grant(now, id, lease, Some(&mut *crew)));
        lease.is_some()
    }

    /// The policy adaptive's: idle workers, the fastest first, repeat what they are predicted to finish earlier.
    pub(super) fn copy_for_the_idle(&mut self, now: Duration, crew: &mut Crew) {
        while let Some((id, speed, round_trip)) = crew.fastest_idle() {
            let mut best: Option<(Duration, Candidate)> = None;
            let mut recheck: Option<Duration> = None;
            for known in self.copyable(now, id) {
                match self.worth_copying_at(now, known, speed, round_trip) {
                    (at, gain) if at <= now => {
                        if best.is_none_or(|(most, _)| gain > most) {
                            best = Some((gain, known));
                        }
                    }
                    (at, _) => recheck = recheck.min(Some(at)).or(Some(at)),
                }
            }
            self.recheck_at = recheck;
            let Some((_, Candidate { frame, segment, .. })) = best else { return };
            let frame = self.frames.iter_mut().find(|known| known.id == frame);
            let Some(lease) = frame.and_then(|frame| frame.copy(segment, id)) else { return };
            self.grant(now, id, lease, Some(&mut *crew));
        }
    }

    /// Unfinished segments that a worker does not render yet, and that few others do.
    fn copyable(&self, now: Duration, id: WorkerId) -> impl Iterator<Item = Candidate> {
        let segments = self.frames.iter().flat_map(|f| f.segments.iter().map(|(n, s)| (f.id, *n, s)));
        let open = segments.filter(move |(_, _, segment)| !segment.done && !segment.holders.contains(&id));
        let is_proven = |worker: &Worker| worker.segments_done > 0;
        let for_proven = self.workers.get(&id).is_some_and(is_proven);
        let trust = move |worker: &Worker| match (is_proven(worker), for_proven) {
            (true, _) => TRUSTED_FOR,
            (false, false) => NEWCOMER_TRUSTED_FOR,
            (false, true) => Duration::ZERO,
        };
        let counted = open.map(move |(frame, segment, known)| {
            let trusted = |holder: &&WorkerId| {
                let worker = self.workers.get(holder);
                let held = worker.and_then(|worker| Some((worker, worker.leases.get(&(frame, segment))?)));
                held.is_some_and(|(worker, held)| held.granted_at.saturating_add(trust(worker)) > now)
            };
            Candidate { frame, segment, copies: known.holders.iter().filter(trusted).count() }
        });
        counted.filter(|known| known.copies < MAX_COPIES)
    }

    /// From when on it pays to render a segment once more, and how much earlier it would be done: at once, if that is
    /// predicted to finish it earlier (or if nothing can be predicted); otherwise when its holder is late by as much as
    /// it takes.
    fn worth_copying_at(
        &self,
        now: Duration,
        known: Candidate,
        speed: Option<f64>,
        round_trip: f64,
    ) -> (Duration, Duration) {
        let key = (known.frame, known.segment);
        let frame = self.frames.iter().find(|frame| frame.id == known.frame);
        let holders = frame.and_then(|frame| frame.segments.get(&known.segment)).map(|s| &s.holders);
        // Those who may have died without a word do not count.
        let holders = holders.into_iter().flatten().filter_map(|holder| self.workers.get(holder));
        let held = holders.filter(|worker| !worker.is_suspect(now)).filter_map(|w| w.leases.get(&key));
        let expected =
            held.map(|held| (held.expected_at, held.work)).min_by_key(|(at, _)| at.unwrap_or(Duration::MAX));
        let (Some((Some(expected_at), work)), Some(speed)) = (expected, speed) else {
            return (now, Duration::MAX);
        };
        let takes = seconds(round_trip + work / speed);
        let done_at = now.saturating_add(takes);
        if done_at < expected_at {
            (now, expected_at - done_at)
        } else {
            (expected_at.saturating_add(takes), takes)
        }
    }
}
