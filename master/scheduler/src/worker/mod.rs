//! State of one worker: its leases, its speed, its liveness and back-off.

use std::collections::BTreeMap;
use std::time::Duration;

use super::active_lease::ActiveLease;
use super::limits::{MAX_FRAMES, TRAILING_FRAMES};
use super::speed::{Observation, Speed};
use super::stall::{Stall, StallReason};
use super::{Cost, FrameId, HostId, Lease};

/// Time between two pings of a worker.
pub(super) const PING_INTERVAL: Duration = Duration::from_secs(2);
/// A worker that is silent for this long is disconnected.
pub(super) const SILENCE_TIMEOUT: Duration = Duration::from_secs(10);
/// A worker that leaves a ping unanswered for this long is suspect: it gets no leases until it is heard again.
const SUSPECT_AFTER: Duration = Duration::from_secs(1);
/// First back-off of a worker that cannot render a frame; doubled with each consecutive failure.
const FIRST_BACKOFF: Duration = Duration::from_secs(1);
/// Longest back-off.
const MAX_BACKOFF: Duration = Duration::from_secs(30);
/// First back-off of a worker with an overdue lease; doubled with each consecutive timeout.
const FIRST_LATE_BACKOFF: Duration = Duration::from_millis(250);
/// Consecutive timeouts up to which a trusted worker counts as one that renders: it backs off for a second by then.
const MAX_VOUCHING_TIMEOUTS: u32 = 3;
/// The slack of a deadline is the largest of: the predicted time, times (this factor times the recent overrun factor,
/// minus 1)...
const SLACK_FACTOR: f64 = 1.25;
const MIN_SLACK: Duration = Duration::from_millis(5);
/// ...this part of a frame's time, times the recent overrun factor up to a limit...
const SLACK_FRAMES: f64 = 0.3;
const MAX_SLACK_OVERRUN: f64 = 4.0;
/// ...this number of round trips; and [`MIN_SLACK`].
const SLACK_ROUND_TRIPS: f64 = 4.0;
/// Frames that a worker keeps at a time: those in flight, and the complete ones that are being verified.
const KNOWN_FRAMES: usize = MAX_FRAMES + TRAILING_FRAMES;

/// Service level that users and the worker have set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Service {
    /// It gets leases.
    Active,
    /// It gets no leases and stays connected.
    Paused,
    /// It gets no leases, and is disconnected once it holds none.
    Draining,
}

/// State of a connected worker.
#[derive(Debug)]
pub(super) struct Worker {
    pub(super) threads: u32,
    pub(super) host: HostId,
    /// Whether the shell vouches for it.
    pub(super) trusted: bool,
    pub(super) leases: BTreeMap<(FrameId, u32), ActiveLease>,
    /// Leases that were revoked because they were overdue. A late answer is still accepted.
    pub(super) overdue: BTreeMap<(FrameId, u32), ActiveLease>,
    /// Whether the worker may still render rows of a dropped lease, because the cancellation is not sent yet.
    pub(super) stale: bool,
    /// Frames that were announced to it most recently.
    announced: [Option<FrameId>; KNOWN_FRAMES],
    pub(super) service: Service,
    pub(super) speed: Speed,
    pub(super) segments_done: u64,
    /// Smoothed round trip time of pings, in seconds.
    pub(super) round_trip: Option<f64>,
    last_alive_at: Duration,
    pinged_at: Duration,
    open_ping: Option<u64>,
    /// Time of the first ping since it was last heard.
    unanswered_since: Option<Duration>,
    last_done_at: Duration,
    backoff_until: Option<Duration>,
    failures: u32,
    /// Consecutive timeouts.
    timeouts: u32,
    /// Progress since it last finished a lease, while it holds leases or has overdue ones.
    stall: Option<Stall>,
}

impl Worker {
    pub(super) fn new(threads: u32, host: HostId, trusted: bool, now: Duration) -> Self {
        Self {
            threads: threads.max(1),
            host,
            trusted,
            leases: BTreeMap::new(),
            overdue: BTreeMap::new(),
            stale: false,
            announced: [None; KNOWN_FRAMES],
            service: Service::Active,
            speed: Speed::new(threads),
            segments_done: 0,
            round_trip: None,
            last_alive_at: now,
            pinged_at: now,
            open_ping: None,
            unanswered_since: None,
            last_done_at: now,
            backoff_until: None,
            failures: 0,
            timeouts: 0,
            stall: None,
        }
    }

    /// Whether it may get leases.
    pub(super) fn is_ready(&self, now: Duration) -> bool {
        self.service == Service::Active && !self.is_suspect(now) && self.backoff_until(now).is_none()
    }

    /// Whether it is trusted and renders, so that untrusted workers are on probation. A late lease or two, which load on its
    /// machine may cause, do not end that.
    pub(super) fn vouches(&self, now: Duration) -> bool {
        let renders = self.failures == 0 && self.timeouts <= MAX_VOUCHING_TIMEOUTS;
        self.trusted && self.service == Service::Active && !self.is_suspect(now) && renders
    }

    /// Whether a ping is unanswered for longer than [`SUSPECT_AFTER`].
    pub(super) fn is_suspect(&self, now: Duration) -> bool {
        self.unanswered_since.is_some_and(|since| since + SUSPECT_AFTER <= now)
    }

    /// Time at which the worker becomes suspect if it stays silent; `None` if it is suspect already.
    pub(super) fn suspect_at(&self, now: Duration) -> Option<Duration> {
        self.unanswered_since.map(|since| since + SUSPECT_AFTER).filter(|&at| at > now)
    }

    /// Returns whether `frame` must be announced to it first, and notes that it has been.
    pub(super) fn must_announce(&mut self, frame: FrameId) -> bool {
        if self.announced.contains(&Some(frame)) {
            return false;
        }
        self.announced.rotate_left(1);
        self.announced[KNOWN_FRAMES - 1] = Some(frame);
        true
    }

    /// Records a lease that was granted.
    pub(super) fn record(&mut self, now: Duration, active: ActiveLease) {
        self.leases.insert((active.lease.frame, active.lease.segment), active);
        self.stall.get_or_insert(Stall::new(now));
    }

    /// Ends a lease that it has answered, active or overdue. Returns the lease with the actual work of its rows,
    /// where that can be measured; `None` if there is no such lease.
    pub(super) fn finish(
        &mut self,
        now: Duration,
        lease: Lease,
        cost: Cost,
        half_life: Duration,
    ) -> Option<(ActiveLease, Option<f64>)> {
        let key = (lease.frame, lease.segment);
        let is_held = self.leases.get(&key).is_some_and(|active| active.lease == lease);
        let list = if is_held { &mut self.leases } else { &mut self.overdue };
        let active = *list.get(&key).filter(|active| active.lease == lease)?;
        list.remove(&key);
        self.mark_alive(now);
        (self.failures, self.timeouts, self.backoff_until) = (0, 0, None);
        let measured = self.measure(now, &active, cost, half_life);
        self.segments_done += 1;
        self.last_done_at = now;
        self.stall = (!self.leases.is_empty() || !self.overdue.is_empty()).then_some(Stall::new(now));
        Some((active, measured))
    }

    /// The actual work of a segment, on the scale of this worker's earlier segments.
    fn measure(
        &mut self,
        now: Duration,
        active: &ActiveLease,
        cost: Cost,
        half_life: Duration,
    ) -> Option<f64> {
        let held_for = now.saturating_sub(active.granted_at).as_secs_f64();
        // No thread can have traced for longer than the lease was held.
        let reported =
            Duration::from_nanos(cost.trace_ns).as_secs_f64().min(held_for * f64::from(self.threads));
        // Its first segment waited for the scene, and a segment that was granted while it was idle waited for the
        // network.
        let had_work = self.segments_done > 0 && active.granted_at < self.last_done_at;
        let busy = had_work.then(|| now.saturating_sub(self.last_done_at).as_secs_f64());
        // A shorter time than between its replies is not believed of an untrusted worker: one thread at least traced.
        let is_doubted = self.segments_done > 0 && !self.trusted;
        let traced = if is_doubted { reported.max(busy.unwrap_or(held_for)) } else { reported };
        let work = self.speed.of_thread().map(|rate| rate * traced).filter(|&work| work > 0.0);
        self.speed.observe(Observation { work: active.work, traced, busy }, half_life);
        work
    }

    /// Time by which a lease may finish later than predicted: `takes` is its predicted time, `overrun` the recent
    /// overrun factor, `frame_interval` the time between two complete frames. Where predictions are right, acting a
    /// third of a frame late is early enough.
    pub(super) fn slack(&self, takes: Duration, overrun: f64, frame_interval: Duration) -> Duration {
        let network = SLACK_ROUND_TRIPS * self.round_trip.unwrap_or(0.0);
        let slack =
            Duration::try_from_secs_f64(network.max(takes.as_secs_f64() * (SLACK_FACTOR * overrun - 1.0)));
        let frames = frame_interval.mul_f64(SLACK_FRAMES * overrun.clamp(1.0, MAX_SLACK_OVERRUN));
        slack.unwrap_or(Duration::MAX).max(frames).max(MIN_SLACK)
    }

    /// Time at which the worker finished its last lease, or joined.
    pub(super) fn last_done_at(&self) -> Duration {
        self.last_done_at
    }

    /// Time at which the first lease of the worker becomes overdue.
    pub(super) fn next_deadline(&self) -> Option<Duration> {
        self.leases.values().filter_map(|active| active.deadline).min()
    }

    /// Revokes all of its leases because one is overdue, and backs off until it answers. Returns the keys of the
    /// leases.
    pub(super) fn time_out(&mut self, now: Duration) -> Vec<(FrameId, u32)> {
        if let Some(first) =
            self.leases.values().min_by_key(|active| active.deadline.unwrap_or(Duration::MAX))
        {
            let since = first.granted_at.max(self.last_done_at);
            self.speed.observe_unfinished(first.work, now.saturating_sub(since).as_secs_f64());
        }
        let backoff = FIRST_LATE_BACKOFF.saturating_mul(1 << self.timeouts.min(7)).min(MAX_BACKOFF);
        self.timeouts = self.timeouts.saturating_add(1);
        self.backoff_until = self.backoff_until.max(Some(now + backoff));
        let revoked = std::mem::take(&mut self.leases);
        let keys = revoked.keys().copied().collect();
        self.overdue.extend(revoked);
        keys
    }

    /// When it is disconnected as stalled unless it makes progress or finishes a lease, and the reason. `None` without
    /// leases.
    pub(super) fn stall_deadline(&self, timeout: Duration) -> Option<(Duration, StallReason)> {
        let bands = self.leases.values().chain(self.overdue.values()).map(|active| active.bands);
        self.stall.map(|stall| stall.deadline(timeout, bands.fold(0, u32::saturating_add)))
    }

    /// Notes that its threads have made progress, and may have finished no lease.
    pub(super) fn note_progress(&mut self, now: Duration) {
        if let Some(stall) = &mut self.stall {
            stall.note_progress(now);
        }
    }

    /// Drops its leases of frames before `before`, except second renderings. Returns whether to send the
    /// cancellation now: not while it renders such a frame a second time.
    pub(super) fn cancel(&mut self, before: FrameId) -> bool {
        self.retain_leases(|frame, active| frame >= before || active.verifies);
        let notify = self.stale && !self.verifies_before(before);
        if notify {
            self.mark_cancelled(before);
        }
        notify
    }

    /// Whether it renders rows of a frame before `before` a second time.
    pub(super) fn verifies_before(&self, before: FrameId) -> bool {
        let mut all = self.leases.values().chain(self.overdue.values());
        all.any(|active| active.verifies && active.lease.frame < before)
    }

    /// Notes that the cancellation of all frames before `before` is sent: the worker forgets their views.
    pub(super) fn mark_cancelled(&mut self, before: FrameId) {
        self.stale = false;
        for known in &mut self.announced {
            known.take_if(|frame| *frame < before);
        }
    }

    /// Drops a lease that is not needed any more.
    pub(super) fn drop_lease(&mut self, key: (FrameId, u32)) {
        self.retain_leases(|frame, active| (frame, active.lease.segment) != key);
    }

    /// Keeps the leases that match, active and overdue. The worker goes on rendering the others until it gets a
    /// cancellation. Returns whether there were any.
    fn retain_leases(&mut self, which: impl Fn(FrameId, &ActiveLease) -> bool) -> bool {
        let count = |worker: &Self| worker.leases.len() + worker.overdue.len();
        let before = count(self);
        self.leases.retain(|&(frame, _), active| which(frame, active));
        self.overdue.retain(|&(frame, _), active| which(frame, active));
        let left = count(self);
        if left == 0 {
            self.stall = None;
        }
        self.stale |= left < before;
        left < before
    }

    /// Drops its leases of a frame that leaves flight. Returns whether there were any.
    pub(super) fn drop_frame(&mut self, frame: FrameId) -> bool {
        self.retain_leases(|known, _| known != frame)
    }

    /// Counts it as alive now, and removes the deadlines of its leases, after a pause of the scheduler itself.
    pub(super) fn reset_liveness(&mut self, now: Duration) {
        self.touch(now);
        for active in self.leases.values_mut() {
            (active.expected_at, active.deadline) = (None, None);
        }
    }

    /// Revokes all leases of the worker for good, and returns them by frame and segment.
    pub(super) fn revoke_all(&mut self) -> BTreeMap<(FrameId, u32), ActiveLease> {
        self.overdue.clear();
        self.stall = None;
        std::mem::take(&mut self.leases)
    }

    /// Counts it as alive and not stalled: it is receiving assets.
    pub(super) fn touch(&mut self, now: Duration) {
        self.mark_alive(now);
        self.stall = self.stall.map(|_| Stall::new(now));
    }

    /// Counts it as alive and not stalled: a part of a message has arrived. It stays suspect, since its pings are unanswered.
    pub(super) fn note_arriving(&mut self, now: Duration) {
        self.last_alive_at = now;
        self.note_progress(now);
    }

    pub(super) fn mark_alive(&mut self, now: Duration) {
        self.last_alive_at = now;
        self.unanswered_since = None;
    }

    pub(super) fn pong(&mut self, now: Duration, nonce: u64) {
        self.mark_alive(now);
        if self.open_ping.take_if(|open| *open == nonce).is_some() {
            let seconds = now.saturating_sub(self.pinged_at).as_secs_f64();
            self.round_trip = Some(self.round_trip.map_or(seconds, |old| 0.75 * old + 0.25 * seconds));
        }
    }

    /// Time at which the next ping of the worker is due.
    pub(super) fn next_ping_at(&self) -> Duration {
        self.pinged_at + PING_INTERVAL
    }

    pub(super) fn mark_pinged(&mut self, now: Duration, nonce: u64) {
        (self.pinged_at, self.open_ping) = (now, Some(nonce));
        self.unanswered_since.get_or_insert(now);
    }

    /// Time at which the worker is disconnected if it stays silent.
    pub(super) fn silence_deadline(&self) -> Duration {
        self.last_alive_at + SILENCE_TIMEOUT
    }

    /// Backs off because it cannot render; each consecutive back-off is longer, and its frames are announced anew
    /// afterwards. Returns `false` if it is backing off already.
    pub(super) fn back_off(&mut self, now: Duration) -> bool {
        self.mark_alive(now);
        if self.backoff_until.is_some_and(|until| until > now) {
            return false;
        }
        let backoff = FIRST_BACKOFF.saturating_mul(1 << self.failures.min(5)).min(MAX_BACKOFF);
        self.failures = self.failures.saturating_add(1);
        self.backoff_until = Some(now + backoff);
        self.announced = [None; KNOWN_FRAMES];
        true
    }

    /// Time at which the back-off of the worker ends, if it is backing off.
    pub(super) fn backoff_until(&self, now: Duration) -> Option<Duration> {
        self.backoff_until.filter(|&until| until > now)
    }
}

#[cfg(test)]
mod tests;
