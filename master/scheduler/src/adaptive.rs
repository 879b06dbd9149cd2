//! The policy `adaptive`: the number of rows of a lease, from predicted costs and measured speeds.
//!
//! The ready workers and the queued rows give the time until the frame could be complete, `(R + A) / S`, with R the
//! queued work, A the work under way and S the sum of speeds. Each lease fills a share of the time that its worker has
//! until then. So leases that begin together take equal time, the first ones are large and later ones ever smaller, and
//! the last ones even out wrong predictions.

use std::time::Duration;

use super::forecast::Tiles;
use super::frame::Frame;
use super::limits::MAX_WINDOW;
use super::worker::Worker;
use super::{Scheduler, WorkerId};

/// The share of a worker's time until the frame's end that its next lease fills.
const LEASE_SHARE: f64 = 0.5;
/// Shortest predicted time of a segment, in seconds: a shorter one is not worth its messages.
const MIN_SEGMENT_SECONDS: f64 = 0.0005;
/// Largest share of the time that messages of all workers together take...
const MESSAGES_SHARE: f64 = 0.5;
/// ...where each takes the master this long, in seconds. Measured 5 to 10 us on the machine of docs/benchmarks.md.
const MESSAGE_SECONDS: f64 = 10e-6;
/// Longest predicted time of a segment, in seconds: a longer one loses too much when its worker is lost.
const MAX_SEGMENT_SECONDS: f64 = 0.5;
/// Cost of a second of waiting for a frame's last rows, in seconds, where workers render the next frame meanwhile.
const OVERLAP_WEIGHT: f64 = 0.25;
/// Segments per worker and frame, at least, while no speed is measured. They have at most one tile band per thread: the
/// cost of a band is unknown, and the first reply measures it.
const FIRST_SEGMENTS: u32 = 8;
/// Largest part of the trusted workers' speed that all workers on probation together count as.
const PROBATION_SPEED: f64 = 1.0 / 3.0;

/// A worker that may get leases.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    id: WorkerId,
    threads: f64,
    /// Work per second; `None` while no worker's speed is measured.
    speed: Option<f64>,
    /// Whether `speed` is this worker's own measured one: only then are its leases predicted.
    measured: bool,
    /// Whether it is on probation: its share of a frame is bounded.
    on_probation: bool,
    leases: usize,
    /// Tile bands of its leases.
    bands: u32,
    /// Round trip time in seconds.
    round_trip: f64,
    /// Seconds until its leases are done, or until a message can reach it.
    free_in: f64,
}

/// The workers that are ready at one moment.
#[derive(Debug)]
pub(super) struct Fleet {
    now: Duration,
    candidates: Vec<Candidate>,
    /// Sum of speeds, in work per second; 0 while none is measured.
    total: f64,
    /// Work under way.
    under_way: f64,
}

impl Fleet {
    pub(super) fn of(scheduler: &Scheduler, now: Duration) -> Self {
        let is_able = |worker: &Worker| worker.is_ready(now) && !scheduler.standings.is_excluded(worker);
        let ready = scheduler.workers.iter().filter(|(_, worker)| is_able(worker));
        let of = |(&id, worker): (&WorkerId, &Worker)| {
            let on_probation = scheduler.standings.is_on_probation(worker);
            Candidate { on_probation, ..Candidate::of(id, worker, now) }
        };
        let mut candidates: Vec<Candidate> = ready.map(of).collect();
        let believed = candidates.iter().filter(|candidate| !candidate.on_probation);
        let measured = believed.filter_map(|candidate| Some((candidate.speed?, candidate.threads)));
        let (speed, threads) = measured.fold((0.0, 0.0), |(s, t), (speed, threads)| (s + speed, t + threads));
        if threads > 0.0 {
            // An unmeasured worker is assumed to have the average speed per thread.
            candidates.iter_mut().for_each(|candidate| {
                candidate.speed.get_or_insert(speed / threads * candidate.threads);
            });
        }
        bound_speeds_on_probation(&mut candidates);
        let total = candidates.iter().filter_map(|candidate| candidate.speed).sum();
        let under_way =
            candidates.iter().filter_map(|candidate| Some(candidate.speed? * candidate.free_in)).sum();
        Self { now, candidates, total, under_way }
    }

    /// Indices of the candidates with room for a lease, the soonest idle first, then the fastest.
    pub(super) fn soonest_idle_first(&self) -> Vec<usize> {
        let mut order: Vec<usize> =
            (0..self.candidates.len()).filter(|&index| self.has_room(index)).collect();
        let free_in = |index: &usize| self.candidates.get(*index).map_or(0.0, |candidate| candidate.free_in);
        let speed =
            |index: &usize| self.candidates.get(*index).and_then(|candidate| candidate.speed).unwrap_or(0.0);
        order.sort_by(|a, b| free_in(a).total_cmp(&free_in(b)).then(speed(b).total_cmp(&speed(a))));
        order
    }

    pub(super) fn id(&self, index: usize) -> Option<WorkerId> {
        self.candidates.get(index).map(|candidate| candidate.id)
    }

    /// Whether a candidate has room for a lease. It holds one to render and one to continue with, and more where its
    /// threads need more to be busy, or where it would finish them before a reply to its last pixels could reach it.
    fn has_room(&self, index: usize) -> bool {
        let Some(candidate) = self.candidates.get(index) else { return false };
        let occupied = f64::from(candidate.bands) >= 2.0 * candidate.threads
            && candidate.free_in > 2.0 * candidate.round_trip;
        candidate.leases < 2 || (candidate.measured && candidate.leases < MAX_WINDOW && !occupied)
    }

    /// Adds a lease to a candidate. Returns its predicted arrival and the time it takes; `None` for an unmeasured worker.
    pub(super) fn predict(
        &mut self,
        id: WorkerId,
        work: f64,
        longest_band: f64,
    ) -> Option<(Duration, Duration)> {
        let index = self.candidates.binary_search_by_key(&id, |candidate| candidate.id).ok()?;
        let candidate = self.candidates.get_mut(index)?;
        candidate.leases += 1;
        candidate.bands += 1;
        let speed = candidate.speed?;
        // One thread traces a band.
        let takes = (work / speed).max(longest_band / speed * candidate.threads);
        candidate.free_in += work / speed;
        self.under_way += work;
        let at = self.now.saturating_add(seconds(candidate.free_in.max(takes)));
        candidate.measured.then_some((at, seconds(takes)))
    }

    /// The fastest worker without leases that is not on probation, its speed and its round trip time in seconds.
    pub(super) fn fastest_idle(&self) -> Option<(WorkerId, Option<f64>, f64)> {
        let idle =
            self.candidates.iter().filter(|candidate| candidate.leases == 0 && !candidate.on_probation);
        let best = idle.max_by(|a, b| a.speed.unwrap_or(0.0).total_cmp(&b.speed.unwrap_or(0.0)))?;
        Some((best.id, best.speed, best.round_trip))
    }

    /// Seconds until the first candidate could have done this work.
    fn soonest_done(&self, work: f64) -> f64 {
        // An unmeasured worker that holds a lease is not predictable, and one on probation may not get the rows.
        let predictable =
            |candidate: &&Candidate| !candidate.on_probation && (candidate.measured || candidate.leases == 0);
        let candidates = self.candidates.iter().filter(predictable);
        let done_in = candidates.filter_map(|candidate| Some(candidate.free_in + work / candidate.speed?));
        done_in.fold(f64::INFINITY, f64::min)
    }
}

impl Candidate {
    fn of(id: WorkerId, worker: &Worker, now: Duration) -> Self {
        let round_trip = worker.round_trip.unwrap_or(0.0);
        let last = worker.leases.values().filter_map(|active| active.expected_at).max();
        let left = last.map_or(0.0, |at| at.saturating_sub(now).as_secs_f64());
        let bands = worker.leases.values().map(|active| active.bands).sum();
        Self {
            id,
            threads: f64::from(worker.threads),
            speed: worker.speed.value(),
            measured: worker.speed.value().is_some(),
            on_probation: false,
            leases: worker.leases.len(),
            bands,
            round_trip,
            free_in: left.max(round_trip / 2.0),
        }
    }
}

impl Scheduler {
    /// Number of rows of a frame's queue that a candidate gets; `None` if another worker will have done them sooner.
    pub(super) fn adaptive_rows(&mut self, index: usize, fleet: &Fleet, candidate: usize) -> Option<u32> {
        let frame = self.frames.get(index)?;
        let range = frame.queue.front()?;
        let candidate = fleet.candidates.get(candidate)?;
        let limit =
            frame.max_rows.min(if candidate.on_probation { frame.probation_rows() } else { u32::MAX });
        if limit == 0 {
            return None;
        }
        let Some(speed) = candidate.speed else {
            let rows = first_rows(frame, fleet.candidates.len(), candidate.threads);
            let step = frame.forecast.tiles.rows.min(rows);
            return Some(to_boundary(range.first, rows, step).min(limit));
        };
        let queued: f64 = self.frames.iter().take(index + 1).map(Frame::queued_work).sum();
        let until_done = (queued + fleet.under_way) / fleet.total;
        let messages = fleet.candidates.len() as f64 * MESSAGE_SECONDS / MESSAGES_SHARE;
        let shortest = MIN_SEGMENT_SECONDS.max(messages);
        let takes = (LEASE_SHARE * (until_done - candidate.free_in)).clamp(shortest, MAX_SEGMENT_SECONDS);
        let rows = frame.forecast.rows_for(range.first, range.count, takes * speed);
        let step = self.cut_step(frame, fleet, candidate.free_in, speed, until_done);
        let rows = to_boundary(range.first, rows, step).min(limit).min(range.count);
        let work = frame.forecast.work(range.first..range.first + rows);
        // Near the end, another worker may be free and done sooner. Where all are idle, each might leave the rows to
        // another one, so then the candidate takes them.
        let done_in = candidate.free_in + work / speed;
        let all_idle = fleet.candidates.iter().all(|candidate| candidate.leases == 0);
        let has_time = all_idle || done_in <= until_done || done_in <= fleet.soonest_done(work) * 1.0001;
        has_time.then_some(rows)
    }

    /// Rows of which cuts are multiples: the height of a tile, or a half, a quarter, ... of it where that completes the
    /// frame earlier. Cutting the next band, and all that are as expensive, adds cost for all workers (see `Tiles`); an
    /// uncut band may make all workers wait for this one.
    fn cut_step(&self, frame: &Frame, fleet: &Fleet, free_in: f64, speed: f64, until_done: f64) -> u32 {
        let Tiles { rows: tile, share } = frame.forecast.tiles;
        let band = |row: u32| {
            let first = row - row % tile;
            frame.forecast.work(first..(first + tile).min(frame.height))
        };
        let Some(next) = frame.queue.front().map(|range| band(range.first)) else { return tile };
        let rows = frame
            .queue
            .iter()
            .flat_map(|range| (range.first..range.first + range.count).step_by(tile as usize));
        let alike: f64 = rows.map(band).filter(|&work| work > next / 2.0).sum();
        // Where the next frame follows, only the picture waits, not the workers.
        let weight = if self.max_frames() > 1 { OVERLAP_WEIGHT } else { 1.0 };
        let seconds = |step: u32| {
            let part = f64::from(step) / f64::from(tile);
            let added = share * (1.0 / part - 1.0);
            let piece = next * (share + (1.0 - share) * part) / speed;
            alike * added / fleet.total + weight * (free_in + piece - until_done).max(0.0)
        };
        let halves = std::iter::successors(Some(tile), |&step| (step > 1).then_some(step / 2));
        halves.min_by(|&a, &b| seconds(a).total_cmp(&seconds(b))).unwrap_or(tile)
    }
}

/// Limits the speeds of the candidates on probation, so that all of them together count as [`PROBATION_SPEED`] of the
/// others.
fn bound_speeds_on_probation(candidates: &mut [Candidate]) {
    let count = candidates.iter().filter(|candidate| candidate.on_probation).count();
    if count == 0 {
        return;
    }
    let others = candidates.iter().filter(|candidate| !candidate.on_probation);
    let bound = others.filter_map(|candidate| candidate.speed).sum::<f64>() * PROBATION_SPEED / count as f64;
    for candidate in candidates.iter_mut().filter(|candidate| candidate.on_probation) {
        candidate.speed = candidate.speed.map(|speed| speed.min(bound)).filter(|&speed| speed > 0.0);
    }
}

/// Number of rows, at least 1, of a lease while no speed is measured, for one of `workers` with `threads` threads.
fn first_rows(frame: &Frame, workers: usize, threads: f64) -> u32 {
    let share = frame.height / (FIRST_SEGMENTS * workers.max(1) as u32);
    share.min((threads as u32).saturating_mul(frame.forecast.tiles.rows)).max(1)
}

/// Number of rows, at least 1, from `first` to the multiple of `step` that is nearest to `first + rows`.
fn to_boundary(first: u32, rows: u32, step: u32) -> u32 {
    let end = first.saturating_add(rows);
    let below = end - end % step;
    let nearest = if end - below > step / 2 { below.saturating_add(step) } else { below };
    if nearest > first { nearest - first } else { (first + 1).next_multiple_of(step) - first }
}

/// A predicted time; `Duration::MAX` for a value that is not a time.
pub(super) fn seconds(value: f64) -> Duration {
    Duration::try_from_secs_f64(value).unwrap_or(Duration::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_fall_on_boundaries() {
        let cuts = [(0, 1), (0, 24), (0, 25), (16, 7), (5, 3), (5, 20)].map(|(f, r)| to_boundary(f, r, 16));
        assert_eq!(cuts, [16, 16, 32, 16, 11, 27]);
        assert_eq!(to_boundary(7, 3, 1), 3);
    }

    #[test]
    fn an_invalid_time_is_the_longest_one() {
        assert_eq!([f64::NAN, f64::INFINITY, -1.0].map(seconds), [Duration::MAX; 3]);
    }
}
