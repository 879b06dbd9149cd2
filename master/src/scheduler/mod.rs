//! Who renders which rows, and what happens when somebody does not.
//!
//! Pure: no clock, no socket, no image byte, no randomness. The same events at the same times give the same
//! actions, so a failure found by a simulation can be replayed from its seed.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

mod action;
mod adaptive;
mod assign;
mod audits;
pub mod check;
mod copies;
mod cost_map;
mod event;
mod flight;
mod forecast;
mod frame;
mod held;
mod lapses;
mod lots;
mod motion;
pub mod policy;
mod record;
mod second;
mod speed;
mod worker;

#[cfg(test)]
mod audit_scenarios;
#[cfg(test)]
mod scenarios;
#[cfg(test)]
mod service_scenarios;
#[cfg(test)]
mod sizes_tests;
#[cfg(test)]
mod transcript;

pub use action::{Action, Return};
pub use audits::{Finding, Verdict, Verification};
pub use event::{Event, HostId, WorkerId};
pub use policy::SegmentPolicy;
pub use rayfarm_protocol::{Cost, FrameId, Lease};
pub use record::{Progress, WorkerRecord, WorkerState};

use assign::MAX_FRAMES;
use audits::Audits;
use cost_map::CostMap;
use frame::Frame;
use lapses::FIRST_PATIENCE;
use worker::{PING_EVERY, Service, Worker};

/// What a band of tiles costs however few of its rows are traced, as a share of the whole: measured, see
/// [`CostProfile`](crate::measure::simulator::CostProfile).
const TILE_SHARE: f64 = 0.38;
/// What each finished lease leaves of an earlier surprise...
const SURPRISE_MEMORY: f64 = 0.98;
/// ...and how large one may be.
const MAX_SURPRISE: f64 = 10.0;
/// What is known of a worker's speed halves its weight in the time of a frame, and at least in this.
const SHORTEST_HALF_LIFE: Duration = Duration::from_millis(100);
/// A scheduler that has workers and has not been woken for this long was asleep itself: the silence was its own.
const AWAY: Duration = PING_EVERY.saturating_mul(2);

/// Decides what every worker does. Decides on numbers only: pixels go past it.
///
/// The contract, with `now` as the time since any fixed moment:
///
/// 1. Report whatever happens by [`handle`](Self::handle). Times never go backwards.
/// 2. After each event, perform the actions of [`poll_action`](Self::poll_action) in order until there are none.
/// 3. Unless something happens before, report [`Event::Woken`] at the time of [`poll_timeout`](Self::poll_timeout).
///
/// In return: a frame that begins completes as soon as one worker that answers stays connected for long enough,
/// whatever the others do; frames complete in order; an event about a worker or a frame that is gone changes
/// nothing. What holds after every event is written down, and checked, in [`check`].
#[derive(Debug)]
pub struct Scheduler {
    policy: SegmentPolicy,
    max_segment_bytes: u64,
    tile_share: f64,
    pipeline: bool,
    workers: BTreeMap<WorkerId, Worker>,
    /// Frames that have begun, oldest first.
    frames: VecDeque<Frame>,
    /// The newest request that has not begun.
    waiting: Option<Request>,
    costs: CostMap,
    audits: Audits,
    /// Pixels per row of the frame that began last.
    width: u32,
    actions: VecDeque<Action>,
    next_nonce: u64,
    /// How long a worker may owe something without giving anything.
    patience: Duration,
    /// By what factor leases take longer than predicted, at worst and lately.
    surprise: f64,
    /// What the last frame took.
    last_frame: Duration,
    /// When an idle worker may find a lease of somebody else worth repeating.
    recheck_at: Option<Duration>,
    handled_at: Duration,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Request {
    frame: FrameId,
    width: u32,
    height: u32,
    tile_rows: u32,
}

impl Scheduler {
    /// A scheduler without workers and frames. No lease asks for more than `max_segment_bytes` bytes of RGB8
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
            audits: Audits::default(),
            width: 0,
            actions: VecDeque::new(),
            next_nonce: 0,
            patience: FIRST_PATIENCE,
            surprise: 1.0,
            last_frame: Duration::ZERO,
            recheck_at: None,
            handled_at: Duration::ZERO,
        }
    }

    /// Whether idle workers begin the next frame under `adaptive`; they do unless this says otherwise.
    #[must_use]
    pub fn with_pipeline(mut self, pipeline: bool) -> Self {
        self.pipeline = pipeline;
        self
    }

    /// What a band of tiles costs however few of its rows are traced, as a share of the whole.
    #[must_use]
    pub fn with_tile_share(mut self, share: f64) -> Self {
        self.tile_share = share;
        self
    }

    /// Frames in flight at most. The seed knows one.
    fn max_frames(&self) -> usize {
        if self.pipeline && self.policy == SegmentPolicy::Adaptive { MAX_FRAMES } else { 1 }
    }

    /// Takes note of an event and decides what follows from it.
    pub fn handle(&mut self, now: Duration, event: Event) {
        self.excuse_own_absence(now);
        match event {
            Event::FrameRequested { frame, width, height, tile_rows } => {
                self.request(Request { frame, width, height, tile_rows });
            }
            Event::RequestsGivenUp { next } => self.give_up(next),
            Event::WorkerJoined { worker, threads, host } => {
                self.lose(worker);
                self.workers.insert(worker, Worker::new(threads, host, now));
            }
            Event::WorkerLeft { worker } => self.lose(worker),
            Event::WorkerDrains { worker } => self.serve(worker, Service::Draining),
            Event::DrainRequested { worker } => self.drain(worker),
            Event::PauseRequested { worker } => self.serve(worker, Service::Paused),
            Event::ResumeRequested { worker } => self.serve(worker, Service::Active),
            Event::SegmentDone { worker, lease, cost } => self.segment_done(now, worker, lease, cost),
            Event::SegmentVerified { worker, lease, cost, finding } => {
                self.verified(now, worker, lease, cost, finding);
            }
            Event::SegmentJudged { frame, segment, verdict } => self.judged(frame, segment, verdict),
            Event::RowsRejected { frame, first_row, row_count } => {
                self.rejected(frame, first_row, row_count);
            }
            Event::WorkerFailed { worker, frame } => self.worker_failed(now, worker, frame),
            Event::Pong { worker, nonce } => self.pong(now, worker, nonce),
            Event::Heard { worker } => self.fed(now, worker),
            Event::Woken => {
                self.check_pulses(now);
                self.dismiss_stuck(now);
            }
        }
        self.take_overdue(now);
        self.fail_frames();
        self.complete_frames();
        self.judge_next();
        self.assign(now);
        self.dismiss_drained();
        debug_assert_eq!(check::violated(self), None);
    }

    /// The next thing to do.
    pub fn poll_action(&mut self) -> Option<Action> {
        self.actions.pop_front()
    }

    /// When [`Event::Woken`] is due; `None` while nothing but other events can change anything.
    pub fn poll_timeout(&self) -> Option<Duration> {
        let pulses = self.workers.values().flat_map(|worker| {
            let pulse = worker.ping_at().min(worker.lost_at());
            let stuck = worker.waited_for_since().map(|since| since + self.patience);
            let (rested, suspect) = (worker.rested_at(self.handled_at), worker.suspect_at(self.handled_at));
            [Some(pulse), stuck, rested, suspect, worker.overdue_at()]
        });
        pulses.chain([self.recheck_at]).flatten().min()
    }

    fn segment_done(&mut self, now: Duration, id: WorkerId, lease: Lease, cost: Cost) {
        let Some(work) = self.finish(now, id, lease, cost) else { return };
        let Some(frame) = self.frames.iter_mut().find(|frame| frame.id == lease.frame) else { return };
        let fresh = frame.finish(&lease, cost);
        if let Some(work) = work.filter(|_| !fresh.is_empty()) {
            frame.forecast.learn(lease.first_row..lease.first_row + lease.row_count, work);
        }
        self.pick(id, &lease, fresh);
    }

    /// Takes a lease off a worker that has answered it, if it held it; the work that it turned out to be, if that can be
    /// told.
    fn finish(&mut self, now: Duration, id: WorkerId, lease: Lease, cost: Cost) -> Option<Option<f64>> {
        let half_life = self.last_frame.max(SHORTEST_HALF_LIFE);
        let worker = self.workers.get_mut(&id)?;
        let last_done_at = worker.last_done_at();
        let (held, work) = worker.finish(now, lease, cost, half_life)?;
        let surprise = held.surprise(now, last_done_at).unwrap_or(1.0).clamp(1.0, MAX_SURPRISE);
        self.surprise = surprise.max(1.0 + (self.surprise - 1.0) * SURPRISE_MEMORY);
        Some(work)
    }

    /// Changes whether a worker gets leases. One that drains goes on draining: it has been told already.
    fn serve(&mut self, id: WorkerId, service: Service) {
        let Some(worker) = self.workers.get_mut(&id).filter(|w| w.service != Service::Draining) else {
            return;
        };
        worker.service = service;
        if service != Service::Active {
            self.draw_anew(id);
        }
    }

    /// The master's side wants a worker to leave: it is told, so that it says so where it runs.
    fn drain(&mut self, id: WorkerId) {
        if self.workers.get(&id).is_some_and(|worker| worker.service != Service::Draining) {
            self.serve(id, Service::Draining);
            self.actions.push_back(Action::Drain { worker: id });
        }
    }

    fn dismiss_drained(&mut self) {
        let drained = |worker: &Worker| worker.service == Service::Draining && worker.leases.is_empty();
        for id in self.ids_of(drained) {
            self.dismiss(id, "it drains, and has finished its segments".to_owned(), Return::Unwanted);
        }
    }

    fn ids_of(&self, which: impl Fn(&Worker) -> bool) -> Vec<WorkerId> {
        self.workers.iter().filter(|(_, worker)| which(worker)).map(|(&id, _)| id).collect()
    }

    fn pong(&mut self, now: Duration, id: WorkerId, nonce: u64) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.pong(now, nonce);
        }
    }

    fn fed(&mut self, now: Duration, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.fed(now);
        }
    }

    /// After a pause of its own (a suspended machine, a debugger) it has nobody's silence to complain about.
    fn excuse_own_absence(&mut self, now: Duration) {
        if now.saturating_sub(self.handled_at) > AWAY {
            self.workers.values_mut().for_each(|worker| worker.excuse(now));
        }
        self.handled_at = now;
    }

    fn dismiss(&mut self, worker: WorkerId, reason: String, again: Return) {
        self.lose(worker);
        self.actions.push_back(Action::Dismiss { worker, reason, again });
    }

    fn lose(&mut self, id: WorkerId) {
        self.take_leases(id);
        self.workers.remove(&id);
    }

    /// Takes all leases from a worker; its rows go to the front of the queue, in order.
    fn take_leases(&mut self, id: WorkerId) {
        let taken = self.workers.get_mut(&id).map(Worker::take_all).unwrap_or_default();
        self.requeue(id, taken.into_keys().collect());
    }
}
