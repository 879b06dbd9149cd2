//! The policy `adaptive`: how many rows a worker is given, from what rows cost and how fast workers are.
//!
//! All who are ready and all rows that wait give a time at which the frame could be complete: `(R + A) / S`, with R
//! the work that waits, A the work under way and S the sum of speeds. Each lease fills a share of the time that its
//! worker has until then. So leases take equal time wherever they begin together, the first ones are large, those
//! after them ever smaller, and what was predicted wrongly is evened out by the last ones.

use std::time::Duration;

use super::forecast::Tiles;
use super::frame::Frame;
use super::policy::MAX_WINDOW;
use super::worker::Worker;
use super::{Scheduler, WorkerId};

/// The share of a worker's time until the frame's end that its next lease fills.
const SHARE: f64 = 0.5;
/// A segment that takes less is not worth its messages, in seconds.
const SHORTEST_SEGMENT: f64 = 0.0005;
/// Messages of all workers together take at most this share of the time...
const MESSAGES_SHARE: f64 = 0.5;
/// ...where each takes the master so long, in seconds. Measured with some margin: 5 to 10 us on the machine of the
/// README.
const MESSAGE_SECONDS: f64 = 10e-6;
/// A segment that takes longer loses too much when its worker is lost, in seconds.
const LONGEST_SEGMENT: f64 = 0.5;
/// What a second of waiting for a frame's last rows costs, in seconds, where workers begin the next frame meanwhile.
const OVERLAPPED: f64 = 0.25;
/// Into how many segments a worker's part of the frame is cut while no speed is known.
const FIRST_SEGMENTS: u32 = 8;

/// A worker that may be given leases.
#[derive(Clone, Copy, Debug)]
struct Hand {
    id: WorkerId,
    threads: f64,
    /// Work a second; `None` while nothing was measured of anybody.
    speed: Option<f64>,
    /// Whether that is its own measured speed: only then are its leases predicted.
    known: bool,
    leases: usize,
    /// Bands of tiles that it holds.
    bands: u32,
    round_trip: f64,
    /// Seconds until it has done what it holds, or until a message reaches it.
    free_in: f64,
}

/// Who is there to work, at one moment.
#[derive(Debug)]
pub(super) struct Crew {
    now: Duration,
    hands: Vec<Hand>,
    /// Work a second of all; 0 while nothing was measured.
    total: f64,
    /// Work under way.
    under_way: f64,
}

impl Crew {
    pub(super) fn of(scheduler: &Scheduler, now: Duration) -> Self {
        let ready = scheduler.workers.iter().filter(|(_, worker)| worker.is_ready(now));
        let mut hands: Vec<Hand> = ready.map(|(&id, w)| Hand::of(id, w, now)).collect();
        let measured = hands.iter().filter_map(|hand| Some((hand.speed?, hand.threads)));
        let (speed, threads) = measured.fold((0.0, 0.0), |(s, t), (speed, threads)| (s + speed, t + threads));
        if threads > 0.0 {
            // Of whom nothing is known, its threads promise what the others' do.
            hands.iter_mut().for_each(|hand| {
                hand.speed.get_or_insert(speed / threads * hand.threads);
            });
        }
        let total = hands.iter().filter_map(|hand| hand.speed).sum();
        let under_way = hands.iter().filter_map(|hand| Some(hand.speed? * hand.free_in)).sum();
        Self { now, hands, total, under_way }
    }

    pub(super) fn soonest_idle_first(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.hands.len()).filter(|&index| self.wants(index)).collect();
        let free_in = |index: &usize| self.hands.get(*index).map_or(0.0, |hand| hand.free_in);
        let speed = |index: &usize| self.hands.get(*index).and_then(|hand| hand.speed).unwrap_or(0.0);
        order.sort_by(|a, b| free_in(a).total_cmp(&free_in(b)).then(speed(b).total_cmp(&speed(a))));
        order
    }

    pub(super) fn id(&self, index: usize) -> Option<WorkerId> {
        self.hands.get(index).map(|hand| hand.id)
    }

    /// Whether a worker has room for a lease: it holds one to render and one to go on with, and more where it has more
    /// threads than that occupies, or would be done with them before an answer to its last pixels could reach it.
    fn wants(&self, index: usize) -> bool {
        let Some(hand) = self.hands.get(index) else { return false };
        let occupied = f64::from(hand.bands) >= 2.0 * hand.threads && hand.free_in > 2.0 * hand.round_trip;
        hand.leases < 2 || (hand.known && hand.leases < MAX_WINDOW && !occupied)
    }

    /// When a worker will have done a further lease, and how long that takes it; writes down that it has it.
    pub(super) fn expect(
        &mut self,
        id: WorkerId,
        work: f64,
        longest_band: f64,
    ) -> Option<(Duration, Duration)> {
        let index = self.hands.binary_search_by_key(&id, |hand| hand.id).ok()?;
        let hand = self.hands.get_mut(index)?;
        hand.leases += 1;
        hand.bands += 1;
        let speed = hand.speed?;
        // A band is one thread's.
        let takes = (work / speed).max(longest_band / speed * hand.threads);
        hand.free_in += work / speed;
        self.under_way += work;
        let at = self.now.saturating_add(seconds(hand.free_in.max(takes)));
        hand.known.then_some((at, seconds(takes)))
    }

    /// The fastest worker without anything to do, its speed and its round trip.
    pub(super) fn fastest_idle(&self) -> Option<(WorkerId, Option<f64>, f64)> {
        let idle = self.hands.iter().filter(|hand| hand.leases == 0);
        let best = idle.max_by(|a, b| a.speed.unwrap_or(0.0).total_cmp(&b.speed.unwrap_or(0.0)))?;
        Some((best.id, best.speed, best.round_trip))
    }

    /// The soonest that anybody could have done this work.
    fn soonest(&self, work: f64) -> f64 {
        // Of somebody who has never answered, nobody knows when it will.
        let hands = self.hands.iter().filter(|hand| hand.known || hand.leases == 0);
        let done_in = hands.filter_map(|hand| Some(hand.free_in + work / hand.speed?));
        done_in.fold(f64::INFINITY, f64::min)
    }
}

impl Hand {
    fn of(id: WorkerId, worker: &Worker, now: Duration) -> Self {
        let round_trip = worker.round_trip.unwrap_or(0.0);
        let last = worker.leases.values().filter_map(|held| held.expected_at).max();
        let left = last.map_or(0.0, |at| at.saturating_sub(now).as_secs_f64());
        let bands = worker.leases.values().map(|held| held.bands).sum();
        Self {
            id,
            threads: f64::from(worker.threads),
            speed: worker.speed.value(),
            known: worker.speed.value().is_some(),
            leases: worker.leases.len(),
            bands,
            round_trip,
            free_in: left.max(round_trip / 2.0),
        }
    }
}

impl Scheduler {
    /// How many rows of a frame's queue a worker is given; `None`: it had better not take any.
    pub(super) fn forecast_rows(&mut self, index: usize, crew: &Crew, hand: usize) -> Option<u32> {
        let frame = self.frames.get(index)?;
        let run = frame.queue.front()?;
        let limit = self.max_rows(frame.width);
        let hand = crew.hands.get(hand)?;
        let Some(speed) = hand.speed else {
            let rows = frame.height / (FIRST_SEGMENTS * crew.hands.len().max(1) as u32);
            let step = frame.forecast.tiles.rows.min(rows.max(1));
            return Some(to_boundary(run.first, rows.max(1), step).min(limit));
        };
        let waits: f64 = self.frames.iter().take(index + 1).map(Frame::waiting_work).sum();
        let until_done = (waits + crew.under_way) / crew.total;
        let shortest = SHORTEST_SEGMENT.max(crew.hands.len() as f64 * MESSAGE_SECONDS / MESSAGES_SHARE);
        let takes = (SHARE * (until_done - hand.free_in)).clamp(shortest, LONGEST_SEGMENT);
        let rows = frame.forecast.rows_for(run.first, run.count, takes * speed);
        let step = self.step(frame, crew, hand.free_in, speed, until_done);
        let rows = to_boundary(run.first, rows, step).min(limit).min(run.count);
        let work = frame.forecast.work(run.first..run.first + rows);
        // Towards the end, somebody else may be free and done before this one is; but where all are idle, they might each
        // leave it to another.
        let done_in = hand.free_in + work / speed;
        let all_idle = crew.hands.iter().all(|hand| hand.leases == 0);
        let has_time = all_idle || done_in <= until_done || done_in <= crew.soonest(work) * 1.0001;
        has_time.then_some(rows)
    }

    /// Rows of which cuts are multiples: a tile's height, or a half, a quarter, ... of it where that makes the frame
    /// complete earlier. Cutting the next band of tiles, and all that are as expensive, costs everybody (see `CostMap`);
    /// a band that is not cut may keep everybody waiting for this one worker.
    fn step(&self, frame: &Frame, crew: &Crew, free_in: f64, speed: f64, until_done: f64) -> u32 {
        let Tiles { rows: tile, share } = frame.forecast.tiles;
        let band = |row: u32| {
            let first = row - row % tile;
            frame.forecast.work(first..(first + tile).min(frame.height))
        };
        let Some(next) = frame.queue.front().map(|run| band(run.first)) else { return tile };
        let rows =
            frame.queue.iter().flat_map(|run| (run.first..run.first + run.count).step_by(tile as usize));
        let alike: f64 = rows.map(band).filter(|&work| work > next / 2.0).sum();
        // Where the next frame follows, only the picture waits, and nobody who renders.
        let weight = if self.max_frames() > 1 { OVERLAPPED } else { 1.0 };
        let seconds = |step: u32| {
            let part = f64::from(step) / f64::from(tile);
            let added = share * (1.0 / part - 1.0);
            let piece = next * (share + (1.0 - share) * part) / speed;
            alike * added / crew.total + weight * (free_in + piece - until_done).max(0.0)
        };
        let halves = std::iter::successors(Some(tile), |&step| (step > 1).then_some(step / 2));
        halves.min_by(|&a, &b| seconds(a).total_cmp(&seconds(b))).unwrap_or(tile)
    }
}

/// Rows from `first` on that end on the multiple of `step` nearest to `rows`, at least one of them.
fn to_boundary(first: u32, rows: u32, step: u32) -> u32 {
    let end = first.saturating_add(rows);
    let below = end - end % step;
    let nearest = if end - below > step / 2 { below.saturating_add(step) } else { below };
    if nearest > first { nearest - first } else { (first + 1).next_multiple_of(step) - first }
}

/// A predicted time; whatever cannot be one is a very long time.
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
    fn what_is_no_time_is_a_very_long_one() {
        assert_eq!([f64::NAN, f64::INFINITY, -1.0].map(seconds), [Duration::MAX; 3]);
    }
}
