//! One worker as the scheduler knows it: what it holds, how fast it is, whether it still answers.

use std::collections::BTreeMap;
use std::time::Duration;

use super::{Cost, FrameId, Lease};

/// A worker is asked for a sign of life this often.
pub(super) const PING_EVERY: Duration = Duration::from_secs(2);
/// A worker that has given no sign of life for this long is lost.
pub(super) const SILENCE_LIMIT: Duration = Duration::from_secs(10);
/// A worker that leaves a ping unanswered for this long gets no more leases until it gives a sign of life.
const SUSPICION: Duration = Duration::from_secs(1);
/// The first rest of a worker that cannot render a frame; doubled with each failure in a row.
const FIRST_REST: Duration = Duration::from_secs(1);
/// The longest rest.
const LONGEST_REST: Duration = Duration::from_secs(30);
/// What one more observation leaves of the ones before it.
const SPEED_MEMORY: f64 = 0.75;

/// A promise of rows, as kept by the scheduler.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub(super) lease: Lease,
    pub(super) granted_at: Duration,
    /// Predicted work of the rows, see `cost_map`.
    pub(super) work: f64,
    /// When the pixels should be here; `None` while nothing is known of the worker's speed.
    pub(super) expected_at: Option<Duration>,
}

/// What somebody wants of a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Service {
    /// That it renders.
    Active,
    /// That it waits.
    Paused,
    /// That it leaves when it holds nothing any more.
    Draining,
}

/// A connected worker.
#[derive(Debug)]
pub(super) struct Worker {
    pub(super) threads: u32,
    pub(super) leases: BTreeMap<(FrameId, u32), Held>,
    /// The newest frames it has been told of; two are in flight at most.
    announced: [Option<FrameId>; 2],
    pub(super) service: Service,
    pub(super) speed: Speed,
    pub(super) segments_done: u64,
    /// Smoothed round trip of pings, in seconds.
    pub(super) round_trip: Option<f64>,
    last_heard: Duration,
    pinged_at: Duration,
    open_ping: Option<u64>,
    /// Since when it has been asked for a sign of life without giving one.
    unanswered_since: Option<Duration>,
    last_done_at: Duration,
    resting_until: Option<Duration>,
    failures: u32,
}

/// Work per second, as a ratio of two fading sums: segments that arrive in bunches do not make a worker look
/// infinitely fast.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Speed {
    work: f64,
    /// Seconds during which the worker had something to do, on the master's clock.
    busy: f64,
    /// Seconds of tracing summed over its threads, as the worker says.
    traced: f64,
}

impl Speed {
    fn observe(&mut self, work: f64, busy: f64, traced: f64) {
        for (sum, value) in [(&mut self.work, work), (&mut self.busy, busy), (&mut self.traced, traced)] {
            *sum = *sum * SPEED_MEMORY + value;
        }
    }

    /// Work per second including transfer and waiting; `None` before the first observation.
    pub(super) fn delivered(&self) -> Option<f64> {
        (self.work > 0.0 && self.busy > 0.0).then(|| self.work / self.busy)
    }

    /// Work per second of tracing alone.
    fn traced(&self) -> Option<f64> {
        (self.work > 0.0 && self.traced > 0.0).then(|| self.work / self.traced)
    }
}

impl Worker {
    pub(super) fn new(threads: u32, now: Duration) -> Self {
        Self {
            threads: threads.max(1),
            leases: BTreeMap::new(),
            announced: [None; 2],
            service: Service::Active,
            speed: Speed::default(),
            segments_done: 0,
            round_trip: None,
            last_heard: now,
            pinged_at: now,
            open_ping: None,
            unanswered_since: None,
            last_done_at: now,
            resting_until: None,
            failures: 0,
        }
    }

    /// Whether it may be given leases.
    pub(super) fn is_ready(&self, now: Duration) -> bool {
        self.service == Service::Active && !self.is_suspect(now) && self.rested_at(now).is_none()
    }

    /// Whether it may have died without a word.
    pub(super) fn is_suspect(&self, now: Duration) -> bool {
        self.unanswered_since.is_some_and(|since| since + SUSPICION <= now)
    }

    /// When it becomes suspect, if it stays silent and is not suspect already.
    pub(super) fn suspect_at(&self, now: Duration) -> Option<Duration> {
        self.unanswered_since.map(|since| since + SUSPICION).filter(|&at| at > now)
    }

    /// Whether it has yet to be told what `frame` shows; from now on it has been.
    pub(super) fn must_announce(&mut self, frame: FrameId) -> bool {
        if self.announced.contains(&Some(frame)) {
            return false;
        }
        self.announced = [self.announced[1], Some(frame)];
        true
    }

    /// When the leases it holds should all be here.
    pub(super) fn expected_free_at(&self, now: Duration) -> Duration {
        self.leases.values().filter_map(|held| held.expected_at).max().map_or(now, |at| at.max(now))
    }

    /// Takes a finished lease off its list. Returns it with the work it turned out to be, if that can be told.
    pub(super) fn finish(&mut self, now: Duration, lease: Lease, cost: Cost) -> Option<(Held, Option<f64>)> {
        let key = (lease.frame, lease.segment);
        let held = *self.leases.get(&key).filter(|held| held.lease == lease)?;
        self.leases.remove(&key);
        self.heard(now);
        (self.failures, self.resting_until) = (0, None);
        let measured = self.measure(now, &held, cost);
        self.segments_done += 1;
        self.last_done_at = now;
        Some((held, measured))
    }

    /// The work a segment turned out to be. A worker's first segment says nothing: it waited for the scene.
    fn measure(&mut self, now: Duration, held: &Held, cost: Cost) -> Option<f64> {
        if self.segments_done == 0 {
            return None;
        }
        let held_for = now.saturating_sub(held.granted_at).as_secs_f64();
        let busy = now.saturating_sub(held.granted_at.max(self.last_done_at)).as_secs_f64();
        // No thread has traced for longer than the lease was held.
        let traced =
            Duration::from_nanos(cost.trace_ns).as_secs_f64().min(held_for * f64::from(self.threads));
        let work = self.speed.traced().map(|rate| rate * traced).filter(|&work| work > 0.0);
        self.speed.observe(held.work, busy, traced);
        work
    }

    pub(super) fn heard(&mut self, now: Duration) {
        self.last_heard = now;
        self.unanswered_since = None;
    }

    pub(super) fn pong(&mut self, now: Duration, nonce: u64) {
        self.heard(now);
        if self.open_ping.take_if(|open| *open == nonce).is_some() {
            let seconds = now.saturating_sub(self.pinged_at).as_secs_f64();
            self.round_trip = Some(self.round_trip.map_or(seconds, |old| 0.75 * old + 0.25 * seconds));
        }
    }

    /// When the next ping is due.
    pub(super) fn ping_at(&self) -> Duration {
        self.pinged_at + PING_EVERY
    }

    pub(super) fn pinged(&mut self, now: Duration, nonce: u64) {
        (self.pinged_at, self.open_ping) = (now, Some(nonce));
        self.unanswered_since.get_or_insert(now);
    }

    /// When it is lost, if it stays silent.
    pub(super) fn lost_at(&self) -> Duration {
        self.last_heard + SILENCE_LIMIT
    }

    /// It cannot render: it rests, longer each time, and is told of its frames anew afterwards.
    pub(super) fn fail(&mut self, now: Duration) {
        self.heard(now);
        if self.resting_until.is_some_and(|until| until > now) {
            return;
        }
        let rest = FIRST_REST.saturating_mul(1 << self.failures.min(5)).min(LONGEST_REST);
        self.failures = self.failures.saturating_add(1);
        self.resting_until = Some(now + rest);
        self.announced = [None; 2];
    }

    /// When its rest ends, if it rests.
    pub(super) fn rested_at(&self, now: Duration) -> Option<Duration> {
        self.resting_until.filter(|&until| until > now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn hold(worker: &mut Worker, segment: u32, at: Duration) -> Lease {
        let lease = Lease { frame: FrameId(1), segment, attempt: 0, first_row: segment * 8, row_count: 8 };
        let held = Held { lease, granted_at: at, work: 8.0, expected_at: None };
        worker.leases.insert((lease.frame, segment), held);
        lease
    }

    #[test]
    fn speed_is_work_over_busy_time_without_the_first_segment() {
        let mut worker = Worker::new(1, Duration::ZERO);
        let leases = [0, 1, 2].map(|segment| hold(&mut worker, segment, Duration::ZERO));
        let cost = Cost { trace_ns: 1_000_000_000, ..Cost::default() };
        assert!(worker.finish(SECOND * 20, leases[0], cost).is_some());
        assert_eq!(worker.speed.delivered(), None);
        worker.finish(SECOND * 22, leases[1], cost);
        worker.finish(SECOND * 24, leases[2], cost);
        assert_eq!(worker.speed.delivered(), Some(4.0));
    }

    #[test]
    fn a_lease_is_finished_once_and_only_as_granted() {
        let mut worker = Worker::new(1, Duration::ZERO);
        let lease = hold(&mut worker, 0, Duration::ZERO);
        assert!(worker.finish(SECOND, Lease { attempt: 1, ..lease }, Cost::default()).is_none());
        assert!(worker.finish(SECOND, lease, Cost::default()).is_some());
        assert!(worker.finish(SECOND, lease, Cost::default()).is_none());
    }

    #[test]
    fn rests_double_up_to_a_limit_and_end_with_success() {
        let mut worker = Worker::new(1, Duration::ZERO);
        let mut now = Duration::ZERO;
        let mut rests = Vec::new();
        for _ in 0..7 {
            worker.fail(now);
            let until = worker.rested_at(now).unwrap();
            rests.push((until - now).as_secs());
            now = until;
        }
        assert_eq!(rests, [1, 2, 4, 8, 16, 30, 30]);
        let lease = hold(&mut worker, 0, now);
        worker.finish(now, lease, Cost::default());
        worker.fail(now);
        assert_eq!(worker.rested_at(now), Some(now + SECOND));
    }

    #[test]
    fn only_the_open_ping_measures_the_round_trip() {
        let mut worker = Worker::new(1, Duration::ZERO);
        worker.pinged(SECOND, 5);
        worker.pong(SECOND * 2, 4);
        assert_eq!(worker.round_trip, None);
        worker.pong(SECOND * 3, 5);
        assert_eq!(worker.round_trip, Some(2.0));
        assert_eq!(worker.lost_at(), SECOND * 13);
    }
}
