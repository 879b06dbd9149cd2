//! One worker as the scheduler knows it: what it holds, how fast it is, whether it still answers.

use std::collections::BTreeMap;
use std::time::Duration;

use super::assign::MAX_FRAMES;
use super::audits::TRAILING_FRAMES;
use super::held::Held;
use super::speed::{Observation, Speed};
use super::{Cost, FrameId, HostId, Lease};

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
/// The first rest of a worker that was late; doubled with each time in a row.
const FIRST_LATE_REST: Duration = Duration::from_millis(250);
/// A lease is overdue when it takes longer, by this factor, than any lately did beyond their predictions, and at least
/// by this time...
const SLACK_FACTOR: f64 = 1.25;
const LEAST_SLACK: Duration = Duration::from_millis(5);
/// ...and by this part of a frame, times the factor by which predictions have lately been wrong, up to a limit...
const SLACK_FRAMES: f64 = 0.3;
const SLACK_SURPRISE: f64 = 4.0;
/// ...and by so many round trips.
const SLACK_ROUND_TRIPS: f64 = 4.0;
/// Two in flight, and the complete ones that are verified.
const KNOWN_FRAMES: usize = MAX_FRAMES + TRAILING_FRAMES;

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
    pub(super) host: HostId,
    pub(super) leases: BTreeMap<(FrameId, u32), Held>,
    /// Leases that were taken from it because they were overdue: its answer is still welcome.
    pub(super) owed: BTreeMap<(FrameId, u32), Held>,
    /// Whether it renders rows of a frame that was given up meanwhile, and has yet to be told.
    pub(super) stale: bool,
    /// Frames it has lately been told of: those in flight, and those of which rows are verified.
    announced: [Option<FrameId>; KNOWN_FRAMES],
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
    /// Times in a row that it was late.
    lapses: u32,
    /// Since when it owes something without having given anything.
    waited_for_since: Option<Duration>,
}

impl Worker {
    pub(super) fn new(threads: u32, host: HostId, now: Duration) -> Self {
        Self {
            threads: threads.max(1),
            host,
            leases: BTreeMap::new(),
            owed: BTreeMap::new(),
            stale: false,
            announced: [None; KNOWN_FRAMES],
            service: Service::Active,
            speed: Speed::new(threads),
            segments_done: 0,
            round_trip: None,
            last_heard: now,
            pinged_at: now,
            open_ping: None,
            unanswered_since: None,
            last_done_at: now,
            resting_until: None,
            failures: 0,
            lapses: 0,
            waited_for_since: None,
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
        self.announced.rotate_left(1);
        self.announced[KNOWN_FRAMES - 1] = Some(frame);
        true
    }

    /// Writes a lease down.
    pub(super) fn hold(&mut self, now: Duration, held: Held) {
        self.leases.insert((held.lease.frame, held.lease.segment), held);
        self.waited_for_since.get_or_insert(now);
    }

    /// Takes a finished lease off its list, or off the list of what it owes. Returns it with the work it turned out to
    /// be, if that can be told.
    pub(super) fn finish(
        &mut self,
        now: Duration,
        lease: Lease,
        cost: Cost,
        half_life: Duration,
    ) -> Option<(Held, Option<f64>)> {
        let key = (lease.frame, lease.segment);
        let is_held = self.leases.get(&key).is_some_and(|held| held.lease == lease);
        let list = if is_held { &mut self.leases } else { &mut self.owed };
        let held = *list.get(&key).filter(|held| held.lease == lease)?;
        list.remove(&key);
        self.heard(now);
        (self.failures, self.lapses, self.resting_until) = (0, 0, None);
        let measured = self.measure(now, &held, cost, half_life);
        self.segments_done += 1;
        self.last_done_at = now;
        self.waited_for_since = (!self.leases.is_empty() || !self.owed.is_empty()).then_some(now);
        Some((held, measured))
    }

    /// The work that a segment turned out to be, on the scale of this worker's earlier ones.
    fn measure(&mut self, now: Duration, held: &Held, cost: Cost, half_life: Duration) -> Option<f64> {
        let held_for = now.saturating_sub(held.granted_at).as_secs_f64();
        // No thread has traced for longer than the lease was held.
        let traced =
            Duration::from_nanos(cost.trace_ns).as_secs_f64().min(held_for * f64::from(self.threads));
        let work = self.speed.of_thread().map(|rate| rate * traced).filter(|&work| work > 0.0);
        // Its first segment waited for the scene, and one that it was given while it was idle for the network.
        let had_work = self.segments_done > 0 && held.granted_at < self.last_done_at;
        let busy = had_work.then(|| now.saturating_sub(self.last_done_at).as_secs_f64());
        self.speed.observe(Observation { work: held.work, traced, busy }, half_life);
        work
    }

    /// How late it may be with a lease that takes so long, where predictions have lately been wrong by a factor of
    /// `surprise` and a frame is complete every so often: a third of a frame late is soon enough to act, where predictions
    /// are right.
    pub(super) fn slack(&self, takes: Duration, surprise: f64, every: Duration) -> Duration {
        let network = SLACK_ROUND_TRIPS * self.round_trip.unwrap_or(0.0);
        let slack =
            Duration::try_from_secs_f64(network.max(takes.as_secs_f64() * (SLACK_FACTOR * surprise - 1.0)));
        let frames = every.mul_f64(SLACK_FRAMES * surprise.clamp(1.0, SLACK_SURPRISE));
        slack.unwrap_or(Duration::MAX).max(frames).max(LEAST_SLACK)
    }

    /// When it gave its last answer, or joined.
    pub(super) fn last_done_at(&self) -> Duration {
        self.last_done_at
    }

    /// When its first lease is overdue.
    pub(super) fn overdue_at(&self) -> Option<Duration> {
        self.leases.values().filter_map(|held| held.deadline).min()
    }

    /// It is late: what it holds is taken from it, and it rests, unless it answers. Returns what it held.
    pub(super) fn lapse(&mut self, now: Duration) -> Vec<(FrameId, u32)> {
        if let Some(first) = self.leases.values().min_by_key(|held| held.deadline.unwrap_or(Duration::MAX)) {
            let since = first.granted_at.max(self.last_done_at);
            self.speed.miss(first.work, now.saturating_sub(since).as_secs_f64());
        }
        let rest = FIRST_LATE_REST.saturating_mul(1 << self.lapses.min(7)).min(LONGEST_REST);
        self.lapses = self.lapses.saturating_add(1);
        self.resting_until = self.resting_until.max(Some(now + rest));
        let taken = std::mem::take(&mut self.leases);
        let keys = taken.keys().copied().collect();
        self.owed.extend(taken);
        keys
    }

    /// Since when it owes something without having given anything.
    pub(super) fn waited_for_since(&self) -> Option<Duration> {
        self.waited_for_since
    }

    /// Leases of frames before `before` are of no use any more, unless they verify. Whether it is to be told now: it is
    /// not while it verifies rows of such a frame.
    pub(super) fn cancel(&mut self, before: FrameId) -> bool {
        self.keep(|frame, held| frame >= before || held.audit);
        let tell = self.stale && !self.audits_before(before);
        if tell {
            self.told_to_cancel(before);
        }
        tell
    }

    /// Whether it verifies rows of a frame before `before`.
    pub(super) fn audits_before(&self, before: FrameId) -> bool {
        let mut all = self.leases.values().chain(self.owed.values());
        all.any(|held| held.audit && held.lease.frame < before)
    }

    /// It is told to forget all frames before `before`: of any of them, it has to be told again.
    pub(super) fn told_to_cancel(&mut self, before: FrameId) {
        self.stale = false;
        for known in &mut self.announced {
            known.take_if(|frame| *frame < before);
        }
    }

    /// A lease is of no use any more.
    pub(super) fn drop_lease(&mut self, key: (FrameId, u32)) {
        self.keep(|frame, held| (frame, held.lease.segment) != key);
    }

    /// Keeps some of what it holds and owes. It still renders the rest, until it is told. Whether there was any.
    fn keep(&mut self, which: impl Fn(FrameId, &Held) -> bool) -> bool {
        let count = |worker: &Self| worker.leases.len() + worker.owed.len();
        let held = count(self);
        self.leases.retain(|&(frame, _), held| which(frame, held));
        self.owed.retain(|&(frame, _), held| which(frame, held));
        let left = count(self);
        if left == 0 {
            self.waited_for_since = None;
        }
        self.stale |= left < held;
        left < held
    }

    /// A frame is out of flight; whether it held some of it.
    pub(super) fn forget(&mut self, frame: FrameId) -> bool {
        self.keep(|known, _| known != frame)
    }

    /// Nobody listened for a while: what it has not said does not count against it.
    pub(super) fn excuse(&mut self, now: Duration) {
        self.fed(now);
        for held in self.leases.values_mut() {
            (held.expected_at, held.deadline) = (None, None);
        }
    }

    /// Everything that it holds is taken from it for good.
    pub(super) fn take_all(&mut self) -> BTreeMap<(FrameId, u32), Held> {
        self.owed.clear();
        self.waited_for_since = None;
        std::mem::take(&mut self.leases)
    }

    /// Its master sends it what it has asked for.
    pub(super) fn fed(&mut self, now: Duration) {
        self.heard(now);
        self.waited_for_since = self.waited_for_since.map(|_| now);
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

    /// It cannot render: it rests, longer each time, and is told of its frames anew afterwards. Whether this is news: it
    /// is not while it rests.
    pub(super) fn fail(&mut self, now: Duration) -> bool {
        self.heard(now);
        if self.resting_until.is_some_and(|until| until > now) {
            return false;
        }
        let rest = FIRST_REST.saturating_mul(1 << self.failures.min(5)).min(LONGEST_REST);
        self.failures = self.failures.saturating_add(1);
        self.resting_until = Some(now + rest);
        self.announced = [None; KNOWN_FRAMES];
        true
    }

    /// When its rest ends, if it rests.
    pub(super) fn rested_at(&self, now: Duration) -> Option<Duration> {
        self.resting_until.filter(|&until| until > now)
    }
}

#[cfg(test)]
mod tests;
