//! Handing out rows: who is given how many, and when somebody's rows are rendered twice.

use std::time::Duration;

use super::policy::{MAX_WINDOW, SEED_WINDOW, adaptive_step, adaptive_window};
use super::worker::{Held, Worker};
use super::{Action, FrameId, Lease, Scheduler, SegmentPolicy, WorkerId};

/// Frames in flight at most: the oldest, and one that idle workers begin while its last rows are rendered.
pub(super) const MAX_FRAMES: usize = 2;
/// Workers that render the same segment at most.
const MAX_COPIES: usize = 3;
/// A segment is predicted to take this share of the time that the rest of the frame takes all workers together.
const SHARE: f64 = 0.4;
/// A segment that takes less is not worth its messages, in seconds.
const SHORTEST_SEGMENT: f64 = 0.001;
/// A segment that takes longer loses too much when its worker is lost, in seconds.
const LONGEST_SEGMENT: f64 = 0.5;
/// Into how many segments a worker's part of the frame is cut while no speed is known.
const FIRST_SEGMENTS: u32 = 8;

/// What the workers can do together.
struct Strength {
    workers: u32,
    /// Work per second of one render thread, on average over the workers that were measured.
    per_thread: f64,
    /// Work per second of all who are ready; 0 while nothing was measured.
    total: f64,
}

impl Strength {
    fn of(ready: &[&Worker]) -> Self {
        let measured = ready.iter().filter_map(|w| Some((w.speed.delivered()?, w.threads)));
        let (speed, threads) = measured.fold((0.0, 0.0), |(s, n), (speed, t)| (s + speed, n + f64::from(t)));
        let per_thread = if threads > 0.0 { speed / threads } else { 0.0 };
        let mut strength = Self { workers: ready.len() as u32, per_thread, total: 0.0 };
        strength.total = ready.iter().filter_map(|worker| strength.speed(worker)).sum();
        strength
    }

    /// A worker's measured speed, or what its threads promise; `None` while nothing was measured.
    fn speed(&self, worker: &Worker) -> Option<f64> {
        let guess = self.per_thread * f64::from(worker.threads);
        worker.speed.delivered().or_else(|| (guess > 0.0).then_some(guess))
    }
}

impl Scheduler {
    /// Hands out rows until every window is full or nothing is left. Everybody gets a first lease before anybody
    /// gets a second one.
    pub(super) fn assign(&mut self, now: Duration) {
        self.recheck_at = None;
        let ready = self.workers.iter().filter(|(_, worker)| worker.is_ready(now));
        let (ids, ready): (Vec<WorkerId>, Vec<&Worker>) = ready.unzip();
        let strength = Strength::of(&ready);
        for depth in 0..MAX_WINDOW {
            for &id in &ids {
                if self.workers.get(&id).is_some_and(|worker| worker.leases.len() == depth) {
                    self.give_one(now, id, depth, &strength);
                }
            }
        }
    }

    fn give_one(&mut self, now: Duration, id: WorkerId, depth: usize, strength: &Strength) {
        if depth >= self.window(id, strength) {
            return;
        }
        let fresh = self.fresh_lease(id, strength);
        let idle = depth == 0;
        if let Some(lease) = fresh.or_else(|| if idle { self.copied_lease(now, id, strength) } else { None })
        {
            self.grant(now, id, lease, strength);
        }
    }

    /// How many leases a worker may hold.
    fn window(&self, id: WorkerId, strength: &Strength) -> usize {
        match self.policy {
            SegmentPolicy::Static(_) | SegmentPolicy::Smart(_) => SEED_WINDOW,
            SegmentPolicy::Adaptive => {
                let round_trip = self.workers.get(&id).and_then(|worker| worker.round_trip);
                adaptive_window(round_trip.unwrap_or(0.0), self.segment_seconds(strength))
            }
        }
    }

    /// Rows that nobody renders yet, of the oldest frame that has any. An idle worker begins the frame that waits.
    fn fresh_lease(&mut self, id: WorkerId, strength: &Strength) -> Option<Lease> {
        let queued = |scheduler: &Self| scheduler.frames.iter().position(|frame| !frame.queue.is_empty());
        let mut index = queued(self);
        if index.is_none() && self.policy == SegmentPolicy::Adaptive && self.frames.len() < MAX_FRAMES {
            self.begin_waiting();
            index = queued(self);
        }
        let index = index?;
        let rows = self.rows_for(index, id, strength)?;
        self.frames.get_mut(index)?.take(id, rows)
    }

    /// How many rows of a frame's queue a worker is given.
    fn rows_for(&mut self, index: usize, id: WorkerId, strength: &Strength) -> Option<u32> {
        let limit = self.max_rows(self.frames.get(index)?.width);
        match self.policy {
            SegmentPolicy::Static(_) => Some(limit),
            SegmentPolicy::Smart(_) => {
                self.halve_if_near_the_end(index);
                Some(limit)
            }
            SegmentPolicy::Adaptive => Some(self.adaptive_rows(index, id, strength)?.min(limit)),
        }
    }

    /// The seed's rule: the last n_workers / 2 segments are halved.
    fn halve_if_near_the_end(&mut self, index: usize) {
        let near_the_end = self.workers.len() / 2;
        let Some(frame) = self.frames.get_mut(index) else { return };
        let whole = frame.queue.iter().filter(|run| !run.halved).count();
        if whole <= near_the_end && frame.queue.front().is_some_and(|run| !run.halved) {
            frame.halve_front();
        }
    }

    /// Rows that take this worker as long as any other worker's next segment, up to a multiple of the tile height.
    fn adaptive_rows(&self, index: usize, id: WorkerId, strength: &Strength) -> Option<u32> {
        let frame = self.frames.get(index)?;
        let run = frame.queue.front()?;
        let rows = match strength.speed(self.workers.get(&id)?) {
            Some(speed) => self.costs.rows_for(run.first, run.count, self.segment_seconds(strength) * speed),
            None => frame.height / (FIRST_SEGMENTS * strength.workers.max(1)),
        };
        let step = adaptive_step(frame.height, strength.workers, self.tile_rows);
        let end = run.first.saturating_add(rows.max(1)).next_multiple_of(step);
        Some(end - run.first)
    }

    /// How long the next segment should take whoever renders it. Shrinks toward the end of the frame.
    fn segment_seconds(&self, strength: &Strength) -> f64 {
        let frame = self.frames.iter().find(|frame| !frame.queue.is_empty());
        let queue = frame.into_iter().flat_map(|frame| &frame.queue);
        let left: f64 = queue.map(|run| self.costs.work(run.first..run.first + run.count)).sum();
        if strength.total > 0.0 {
            (SHARE * left / strength.total).clamp(SHORTEST_SEGMENT, LONGEST_SEGMENT)
        } else {
            LONGEST_SEGMENT
        }
    }

    /// A segment that others render, for a worker that has nothing else to do.
    fn copied_lease(&mut self, now: Duration, id: WorkerId, strength: &Strength) -> Option<Lease> {
        let mut best: Option<(FrameId, usize, u32)> = None;
        for (frame, segment, copies) in self.copyable(id) {
            match self.worth_copying_at(now, id, frame, segment, strength) {
                at if at <= now => {
                    best = best.min(Some((frame, copies, segment))).or(Some((frame, copies, segment)))
                }
                at => self.recheck_at = self.recheck_at.min(Some(at)).or(Some(at)),
            }
        }
        let (frame, _, segment) = best?;
        self.frames.iter_mut().find(|known| known.id == frame)?.copy(segment, id)
    }

    /// Unfinished segments that a worker does not render yet: frame, number, how many render it.
    fn copyable(&self, id: WorkerId) -> Vec<(FrameId, u32, usize)> {
        let segments =
            self.frames.iter().flat_map(|frame| frame.segments.iter().map(|(n, s)| (frame.id, *n, s)));
        let open = segments.filter(|(_, _, segment)| {
            !segment.done && segment.holders.len() < MAX_COPIES && !segment.holders.contains(&id)
        });
        open.map(|(frame, number, segment)| (frame, number, segment.holders.len())).collect()
    }

    /// From when on it pays to render a segment once more: at once, if that is predicted to finish it earlier (or
    /// if nothing can be predicted, or under the seed's policies); otherwise when its holder is late by as much as
    /// it takes.
    fn worth_copying_at(
        &self,
        now: Duration,
        id: WorkerId,
        frame: FrameId,
        segment: u32,
        strength: &Strength,
    ) -> Duration {
        if self.policy != SegmentPolicy::Adaptive {
            return now;
        }
        // Those who may have died without a word do not count.
        let holders = self.workers.values().filter(|worker| !worker.is_suspect(now));
        let held = holders.filter_map(|worker| worker.leases.get(&(frame, segment)));
        let expected =
            held.map(|held| (held.expected_at, held.work)).min_by_key(|(at, _)| at.unwrap_or(Duration::MAX));
        let copier = self.workers.get(&id);
        let speed = copier.and_then(|worker| strength.speed(worker));
        let (Some((Some(expected_at), work)), Some(speed)) = (expected, speed) else { return now };
        let round_trip = copier.and_then(|worker| worker.round_trip).unwrap_or(0.0);
        let takes = seconds(round_trip + work / speed);
        if now.saturating_add(takes) < expected_at { now } else { expected_at.saturating_add(takes) }
    }

    /// Writes a lease down and has it sent.
    fn grant(&mut self, now: Duration, id: WorkerId, lease: Lease, strength: &Strength) {
        let work = self.costs.work(lease.first_row..lease.first_row + lease.row_count);
        let Some(worker) = self.workers.get_mut(&id) else { return };
        let round_trip = seconds(worker.round_trip.unwrap_or(0.0));
        let starts_at = worker.expected_free_at(now).max(now.saturating_add(round_trip));
        // Without a measurement of this very worker, its scene may still be under way: no prediction.
        let takes = worker.speed.delivered().and(strength.speed(worker)).map(|speed| seconds(work / speed));
        let expected_at = takes.map(|takes| starts_at.saturating_add(takes));
        worker
            .leases
            .insert((lease.frame, lease.segment), Held { lease, granted_at: now, work, expected_at });
        if worker.must_announce(lease.frame) {
            self.actions.push_back(Action::Announce { worker: id, frame: lease.frame });
        }
        self.actions.push_back(Action::Grant { worker: id, lease });
        if let Some(frame) = self.frames.iter_mut().find(|frame| frame.id == lease.frame) {
            frame.started_at.get_or_insert(now);
        }
    }
}

/// A predicted time; whatever cannot be one is a very long time.
fn seconds(value: f64) -> Duration {
    Duration::try_from_secs_f64(value).unwrap_or(Duration::MAX)
}
