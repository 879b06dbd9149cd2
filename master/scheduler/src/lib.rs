//! The scheduler: assigns rows of frames to workers and reassigns those of late, lost and failing ones.
//!
//! Pure: no clock, no socket, no image byte, no randomness. The same events at the same times give the same
//! actions, so a simulation replays a failure from its seed.
//!
//! # Example
//!
//! One worker receives the first of two segments, and a second one as the next in its queue:
//!
//! ```
//! use std::time::Duration;
//!
//! use rayfarm_scheduler::{Action, Event, FrameId, HostId, Scheduler, SegmentPolicy, WorkerId};
//!
//! let mut scheduler = Scheduler::new(SegmentPolicy::Static(16), 1 << 20);
//! let now = Duration::ZERO;
//! scheduler.handle(now, Event::WorkerJoined { worker: WorkerId(1), threads: 2, host: HostId(1), trusted: true });
//! let frame = FrameId(1);
//! scheduler.handle(now, Event::FrameRequested { frame, width: 64, height: 32, row_bytes: 192, tile_rows: 16 });
//!
//! let actions = std::iter::from_fn(|| scheduler.poll_action());
//! let rows: Vec<(u32, u32)> = actions
//!     .filter_map(|action| match action {
//!         Action::Grant { lease, .. } => Some((lease.first_row, lease.row_count)),
//!         _ => None,
//!     })
//!     .collect();
//! assert_eq!(rows, [(0, 16), (16, 16)]);
//! ```

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

mod action;
mod active_lease;
mod adaptive;
mod assign;
pub mod check;
mod comparison;
mod cost_map;
mod event;
mod flight;
mod forecast;
mod frame;
mod keyed_rng;
mod limits;
mod motion;
pub mod policy;
mod record;
mod second;
mod speculation;
mod speed;
mod stall;
mod timeouts;
mod trust;
mod verification;
mod worker;

#[cfg(test)]
mod scenarios;
#[cfg(test)]
mod sizes_tests;
#[cfg(test)]
mod stall_scenarios;
#[cfg(test)]
mod transcript;
#[cfg(test)]
mod trust_tests;

pub use action::Action;
pub use event::{Event, HostId, WorkerId};
pub use policy::SegmentPolicy;
pub use rayfarm_protocol::{Cost, FrameId, Lease, Reconnect};
pub use record::{Progress, WorkerRecord, WorkerState};
pub use verification::{ArbiterResult, Finding, Verification};

use cost_map::CostMap;
use flight::Request;
use frame::Frame;
use limits::MAX_FRAMES;
use timeouts::FIRST_STALL_TIMEOUT;
use trust::Standings;
use verification::VerificationQueue;
use worker::{PING_INTERVAL, Service, Worker};

/// The part of a tile band's cost that does not depend on how many of its rows are traced: 38 % as measured on a bust of
/// 99,938 triangles.
const TILE_SHARE: f64 = 0.38;
/// Decay of the overrun factor (actual / predicted time) per finished lease.
const OVERRUN_DECAY: f64 = 0.98;
/// Largest overrun factor of one lease.
const MAX_OVERRUN: f64 = 10.0;
/// Observations of a worker's speed lose half of their weight in the time of a frame, and in no less than this.
const MIN_HALF_LIFE: Duration = Duration::from_millis(100);
/// A longer gap between two events means that the scheduler itself was suspended, not that the workers were silent.
const OWN_PAUSE: Duration = PING_INTERVAL.saturating_mul(2);

/// Decides what every worker does. Works on numbers only: pixels bypass it.
///
/// The contract, with `now` as the time since any fixed moment:
///
/// 1. Report every event to [`handle`](Self::handle). Times never decrease.
/// 2. After each event, perform the actions of [`poll_action`](Self::poll_action) in order until there are none.
/// 3. Report [`Event::Woken`] at the time of [`poll_timeout`](Self::poll_timeout), unless another event comes first. Before
///    it, report [`Event::Receiving`] for those [`silent`](Self::silent) workers of which a message is arriving.
///
/// In return: a frame that has begun completes as soon as one worker that answers stays connected for long enough,
/// whatever the others do; frames complete in order; an event about an unknown worker or frame changes nothing.
/// [`check`] lists the invariants after every event and checks them.
#[derive(Debug)]
pub struct Scheduler {
    policy: SegmentPolicy,
    max_segment_bytes: u64,
    tile_share: f64,
    pipeline: bool,
    workers: BTreeMap<WorkerId, Worker>,
    /// Frames in flight, oldest first.
    frames: VecDeque<Frame>,
    /// The newest request that has not begun.
    waiting: Option<Request>,
    costs: CostMap,
    verifications: VerificationQueue,
    standings: Standings,
    /// Pixels per row of the frame that began last.
    width: u32,
    actions: VecDeque<Action>,
    next_nonce: u64,
    /// A worker that holds leases and makes no progress for this long is disconnected.
    stall_timeout: Duration,
    /// Recent worst ratio of actual to predicted lease time, at least 1.
    overrun: f64,
    /// Time from the first lease to the last row of the last complete frame.
    last_frame: Duration,
    /// Time from which a backup task on an idle worker may pay.
    recheck_at: Option<Duration>,
    handled_at: Duration,
}

impl Scheduler {
    /// Creates a scheduler without workers and frames. No lease covers more than `max_segment_bytes` bytes of pixels
    /// pixels, except that a single row is always one lease.
    pub fn new(policy: SegmentPolicy, max_segment_bytes: u64) -> Self {
        Self {
            policy,
            max_segment_bytes,
            tile_share: TILE_SHARE,
            pipeline: true,
            workers: BTreeMap::new(),
            frames: VecDeque::new(),
            waiting: None,
            costs: CostMap::default(),
            verifications: VerificationQueue::default(),
            standings: Standings::default(),
            width: 0,
            actions: VecDeque::new(),
            next_nonce: 0,
            stall_timeout: FIRST_STALL_TIMEOUT,
            overrun: 1.0,
            last_frame: Duration::ZERO,
            recheck_at: None,
            handled_at: Duration::ZERO,
        }
    }

    /// Sets whether idle workers begin the next frame under `adaptive`; the default is `true`.
    #[must_use]
    pub fn with_pipeline(mut self, pipeline: bool) -> Self {
        self.pipeline = pipeline;
        self
    }

    /// Sets the part (0 to 1) of a tile band's cost that does not depend on how many of its rows are traced.
    #[must_use]
    pub fn with_tile_share(mut self, share: f64) -> Self {
        self.tile_share = share;
        self
    }

    /// Frames in flight at most: 1 under the policies `static` and `smart`.
    fn max_frames(&self) -> usize {
        if self.pipeline && self.policy == SegmentPolicy::Adaptive { MAX_FRAMES } else { 1 }
    }

    /// Applies an event and queues the actions that follow from it.
    pub fn handle(&mut self, now: Duration, event: Event) {
        self.detect_own_pause(now);
        match event {
            Event::FrameRequested { frame, width, height, row_bytes, tile_rows } => {
                self.request(Request { frame, width, height, row_bytes, tile_rows });
            }
            Event::RequestsDropped { next } => self.drop_requests(next),
            Event::WorkerJoined { worker, threads, host, trusted } => {
                self.remove_worker(worker);
                self.workers.insert(worker, Worker::new(threads, host, trusted, now));
            }
            Event::BanLifted { host } => self.standings.forget(host),
            Event::WorkerLeft { worker } => self.remove_worker(worker),
            Event::WorkerDrains { worker } => self.set_service(worker, Service::Draining),
            Event::DrainRequested { worker } => self.drain(worker),
            Event::PauseRequested { worker } => self.set_service(worker, Service::Paused),
            Event::ResumeRequested { worker } => self.set_service(worker, Service::Active),
            Event::SegmentDone { worker, lease, cost } => self.segment_done(now, worker, lease, cost),
            Event::SegmentVerified { worker, lease, cost, finding } => {
                self.segment_verified(now, worker, lease, cost, finding);
            }
            Event::SegmentArbitrated { frame, segment, result } => {
                self.segment_arbitrated(frame, segment, result);
            }
            Event::RowsRejected { frame, first_row, row_count } => {
                self.rows_rejected(frame, first_row, row_count);
            }
            Event::WorkerFailed { worker, frame } => self.worker_failed(now, worker, frame),
            Event::Pong { worker, nonce, progressed } => self.pong(now, worker, nonce, progressed),
            Event::Heard { worker } => self.touch(now, worker),
            Event::Receiving { worker } => {
                self.workers.get_mut(&worker).into_iter().for_each(|known| known.note_arriving(now));
            }
            Event::Woken => {
                self.keepalive(now);
                self.disconnect_stalled(now);
            }
        }
        self.revoke_overdue(now);
        self.fail_frames();
        self.complete_frames();
        self.arbitrate_next();
        self.note_trusted();
        self.assign(now);
        self.disconnect_drained();
        debug_assert_eq!(check::violated(self), None);
    }

    /// The next action to perform; `None` when the queue is empty.
    pub fn poll_action(&mut self) -> Option<Action> {
        self.actions.pop_front()
    }

    /// Time at which [`Event::Woken`] is due; `None` while only other events can change anything.
    pub fn poll_timeout(&self) -> Option<Duration> {
        let timers = self.workers.values().flat_map(|worker| {
            let keepalive = worker.next_ping_at().min(worker.silence_deadline());
            let stalled = worker.stall_deadline(self.stall_timeout).map(|(at, _)| at);
            let now = self.handled_at;
            let (ready, suspect) = (worker.backoff_until(now), worker.suspect_at(now));
            [Some(keepalive), stalled, ready, suspect, worker.next_deadline()]
        });
        timers.chain([self.recheck_at]).flatten().min()
    }

    /// Workers that the next [`Event::Woken`] disconnects at `now` because no message of theirs has arrived for 10 s.
    pub fn silent(&self, now: Duration) -> Vec<WorkerId> {
        self.ids_of(|worker| worker.silence_deadline() <= now)
    }

    fn segment_done(&mut self, now: Duration, id: WorkerId, lease: Lease, cost: Cost) {
        let Some(work) = self.finish_lease(now, id, lease, cost) else { return };
        let Some(frame) = self.frames.iter_mut().find(|frame| frame.id == lease.frame) else { return };
        let fresh = frame.finish(&lease, cost);
        // False times of a worker on probation must not change the leases of others.
        let on_probation = self.workers.get(&id).is_some_and(|worker| self.standings.is_on_probation(worker));
        if let Some(work) = work.filter(|_| !fresh.is_empty() && !on_probation) {
            frame.forecast.learn(lease.first_row..lease.first_row + lease.row_count, work);
        }
        self.sample_for_verification(id, &lease, fresh);
    }

    /// Ends a lease that its worker has answered. `None` if the worker does not hold it; otherwise the actual work of
    /// the rows, where it can be measured.
    fn finish_lease(&mut self, now: Duration, id: WorkerId, lease: Lease, cost: Cost) -> Option<Option<f64>> {
        let half_life = self.last_frame.max(MIN_HALF_LIFE);
        let worker = self.workers.get_mut(&id)?;
        let last_done_at = worker.last_done_at();
        let (active, work) = worker.finish(now, lease, cost, half_life)?;
        let overrun = active.overrun(now, last_done_at).unwrap_or(1.0).clamp(1.0, MAX_OVERRUN);
        self.overrun = overrun.max(1.0 + (self.overrun - 1.0) * OVERRUN_DECAY);
        Some(work)
    }

    /// Sets whether a worker gets leases. Draining is final.
    fn set_service(&mut self, id: WorkerId, service: Service) {
        let Some(worker) = self.workers.get_mut(&id).filter(|w| w.service != Service::Draining) else {
            return;
        };
        worker.service = service;
        if service != Service::Active {
            self.redraw_second_renderers(id);
        }
    }

    /// Drains a worker on request of the master and notifies it, so that its log says why it ends.
    fn drain(&mut self, id: WorkerId) {
        if self.workers.get(&id).is_some_and(|worker| worker.service != Service::Draining) {
            self.set_service(id, Service::Draining);
            self.actions.push_back(Action::Drain { worker: id });
        }
    }

    fn disconnect_drained(&mut self) {
        let drained = |worker: &Worker| worker.service == Service::Draining && worker.leases.is_empty();
        for id in self.ids_of(drained) {
            self.disconnect(id, "it drains and holds no more leases".to_owned(), Reconnect::Never);
        }
    }

    fn ids_of(&self, which: impl Fn(&Worker) -> bool) -> Vec<WorkerId> {
        self.workers.iter().filter(|(_, worker)| which(worker)).map(|(&id, _)| id).collect()
    }

    fn pong(&mut self, now: Duration, id: WorkerId, nonce: u64, progressed: bool) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.pong(now, nonce);
            if progressed {
                worker.note_progress(now);
            }
        }
    }

    fn touch(&mut self, now: Duration, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.touch(now);
        }
    }

    /// After a pause of the scheduler's own process (suspend, debugger), silence of the workers proves nothing.
    fn detect_own_pause(&mut self, now: Duration) {
        if now.saturating_sub(self.handled_at) > OWN_PAUSE {
            self.workers.values_mut().for_each(|worker| worker.reset_liveness(now));
        }
        self.handled_at = now;
    }

    fn disconnect(&mut self, worker: WorkerId, reason: String, reconnect: Reconnect) {
        self.remove_worker(worker);
        self.actions.push_back(Action::Disconnect { worker, reason, reconnect });
    }

    fn remove_worker(&mut self, id: WorkerId) {
        self.revoke_leases(id);
        self.workers.remove(&id);
    }

    /// Revokes all leases of a worker; their rows go to the front of the queue, in order.
    fn revoke_leases(&mut self, id: WorkerId) {
        let revoked = self.workers.get_mut(&id).map(Worker::revoke_all).unwrap_or_default();
        self.requeue(id, revoked.into_keys().collect());
    }
}
