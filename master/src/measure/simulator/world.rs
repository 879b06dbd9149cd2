//! The event loop of a simulated farm: events into the scheduler, actions out of it, messages over the links.

use std::collections::{BTreeMap, VecDeque};

use rayfarm_scheduler::{Action, Event, FrameId, HostId, Lease, Scheduler, WorkerId, check};

use super::clock::{Clock, MasterMessage, SECOND, SimEvent};
use super::counters::{Counters, Measured};
use super::link::Lane;
use super::machine::Machine;
use super::rng::Rng;
use super::setup::Setup;
use super::shell::Shell;
use crate::viewer::OPEN_REQUESTS;

/// Longest virtual time of a measurement.
const MAX_VIRTUAL_TIME: u64 = 3600 * SECOND;
/// Events at one time at most: more means that the scheduler requests timeouts that have passed already.
const MAX_STEPS_AT_ONCE: u32 = 100_000;
/// Largest lease in bytes, as in the protocol.
const MAX_SEGMENT_BYTES: u64 = 32 << 20;
/// Time in which the master renders a segment itself.
const ARBITRATION_TIME: u64 = SECOND / 10;

/// A requested frame that has not ended.
#[derive(Clone, Copy, Debug)]
struct Open {
    requested_at: u64,
    /// Idle work until its last row was leased.
    idle_before: Option<f64>,
}

/// State of a simulated farm.
#[derive(Debug)]
pub(crate) struct World {
    pub(crate) setup: Setup,
    pub(crate) clock: Clock,
    pub(crate) rng: Rng,
    pub(crate) scheduler: Scheduler,
    pub(crate) shell: Shell,
    pub(crate) machines: BTreeMap<WorkerId, Machine>,
    pub(crate) counters: Counters,
    /// The first violated invariant.
    pub(crate) violation: Option<String>,
    /// Whether the invariants are checked after every event.
    pub(crate) checking: bool,
    pub(crate) requested: u64,
    pub(crate) faults: bool,
    /// Whether a complete frame is followed by a request for the next one.
    pub(crate) requests_more: bool,
    open: BTreeMap<FrameId, Open>,
    /// Prefix sums of row costs, by frame.
    pub(super) costs: BTreeMap<u64, Vec<f64>>,
    last_worker: u64,
    /// Idle work until the last frame was complete, so that each idle tail counts once.
    idle_counted: f64,
    pub(super) master_in: Lane,
    pub(super) master_out: Lane,
    pub(super) master: Lane,
}

impl World {
    pub(crate) fn new(setup: Setup) -> Self {
        let scheduler = Scheduler::new(setup.policy, MAX_SEGMENT_BYTES)
            .with_pipeline(setup.pipeline)
            .with_tile_share(setup.tile_share)
            .with_verification(setup.verify_percent, blake3::hash(&setup.seed.to_le_bytes()).into());
        Self {
            clock: Clock::default(),
            rng: Rng::new(setup.seed),
            scheduler,
            shell: Shell::default(),
            machines: BTreeMap::new(),
            counters: Counters::default(),
            violation: None,
            checking: false,
            requested: 0,
            faults: false,
            requests_more: true,
            open: BTreeMap::new(),
            costs: BTreeMap::new(),
            last_worker: 0,
            idle_counted: 0.0,
            master_in: Lane::default(),
            master_out: Lane::default(),
            master: Lane::default(),
            setup,
        }
    }

    /// Speeds of the workers in random order: evenly spaced from the slowest to the fastest, 1 on average.
    fn speeds(&mut self) -> Vec<f64> {
        let (count, spread) = (self.setup.workers, self.setup.spread.max(1.0));
        let slowest = 2.0 / (1.0 + spread);
        let step = if count > 1 { (spread - 1.0) * slowest / f64::from(count - 1) } else { 0.0 };
        let first = if count > 1 { slowest } else { 1.0 };
        let mut speeds: Vec<f64> = (0..count).map(|n| first + step * f64::from(n)).collect();
        self.rng.shuffle(&mut speeds);
        speeds
    }

    /// Runs [`super::measure`].
    pub(crate) fn measure(mut self) -> Option<Measured> {
        let warm_up = 2 + self.setup.frames / 5;
        self.begin();
        self.run(MAX_VIRTUAL_TIME, |world| world.counters.frames >= warm_up);
        self.counters.restart(self.clock.now);
        self.idle_counted = 0.0;
        self.open.values_mut().for_each(|open| open.idle_before = open.idle_before.map(|_| 0.0));
        let frames = self.setup.frames;
        self.run(MAX_VIRTUAL_TIME, |world| world.counters.frames >= frames);
        let measured = self.counters.measured(self.clock.now, self.setup.frame_seconds);
        (measured.frames >= frames && self.violation.is_none()).then_some(measured)
    }

    /// Adds the healthy workers and requests the first frames.
    pub(crate) fn begin(&mut self) {
        for speed in self.speeds() {
            self.join(speed);
        }
        for _ in 0..OPEN_REQUESTS {
            self.request();
        }
        if self.setup.input_rate > 0.0 {
            self.clock.schedule(0, SimEvent::Input);
        }
    }

    pub(crate) fn join(&mut self, speed: f64) -> WorkerId {
        self.last_worker += 1;
        let id = WorkerId(self.last_worker);
        let machine = Machine::new(speed, self.setup.threads, self.setup.round_trip / 2);
        self.machines.insert(id, machine);
        self.counters.power += speed;
        self.shell.join(id);
        if self.last_worker <= u64::from(self.setup.corrupt_workers) {
            self.corrupt(id);
        }
        let host =
            if self.last_worker <= u64::from(self.setup.colocated_workers) { 0 } else { self.last_worker };
        let threads = self.setup.threads;
        let trusted = self.last_worker > u64::from(self.setup.untrusted_workers);
        self.handle(Event::WorkerJoined { worker: id, threads, host: HostId(host.into()), trusted });
        id
    }

    /// Makes a worker corrupt from now on.
    pub(crate) fn corrupt(&mut self, id: WorkerId) {
        self.shell.corrupt.insert(id, self.setup.corruption);
    }

    /// Number of workers that have joined so far.
    pub(crate) fn joined(&self) -> u64 {
        self.last_worker
    }

    /// Closes a connection at both ends.
    pub(crate) fn remove_worker(&mut self, id: WorkerId) {
        if let Some(machine) = self.machines.remove(&id) {
            let tracing: f64 = machine.threads.iter().flatten().map(|band| band.speed).sum();
            self.counters.trace(self.clock.now, -tracing);
            self.counters.power -= machine.speed;
        }
        self.shell.leave(id);
    }

    pub(crate) fn disconnect(&mut self, worker: WorkerId) {
        self.remove_worker(worker);
        self.handle(Event::WorkerLeft { worker });
    }

    pub(crate) fn request(&mut self) {
        self.requested += 1;
        let frame = FrameId(self.requested);
        self.open.insert(frame, Open { requested_at: self.clock.now, idle_before: None });
        let (width, height) = self.setup.size;
        let (row_bytes, tile_rows) = (3 * u64::from(width), self.setup.tile_rows);
        self.handle(Event::FrameRequested { frame, width, height, row_bytes, tile_rows });
    }

    /// Reports an event to the scheduler and performs the actions that follow.
    pub(crate) fn handle(&mut self, event: Event) {
        let mut events = VecDeque::from([event]);
        while let Some(event) = events.pop_front() {
            self.scheduler.handle(self.clock.time(), event);
            if self.checking && self.violation.is_none() {
                let violated = check::violated(&self.scheduler);
                self.violation = violated.map(|what| format!("{what}, after {event:?}"));
            }
            while let Some(action) = self.scheduler.poll_action() {
                self.perform(action, &mut events);
            }
        }
    }

    /// Runs until a time, until `enough` holds, or until an invariant is violated.
    pub(crate) fn run(&mut self, until: u64, enough: impl Fn(&Self) -> bool) {
        let mut steps_at_once = 0;
        while self.violation.is_none() && !enough(self) {
            let timeout = self.scheduler.poll_timeout().map(|at| at.as_nanos() as u64);
            let scheduled = self.clock.next_at();
            let Some(next) = timeout.into_iter().chain(scheduled).min().filter(|&at| at <= until) else {
                self.clock.now = self.clock.now.max(until);
                return;
            };
            steps_at_once = if next > self.clock.now { 0 } else { steps_at_once + 1 };
            if steps_at_once > MAX_STEPS_AT_ONCE {
                self.violation = Some("the scheduler never stops requesting timeouts".to_owned());
            }
            self.clock.now = self.clock.now.max(next);
            match scheduled.filter(|&at| at <= next).and_then(|_| self.clock.pop()) {
                Some(event) => self.dispatch(event),
                None => self.handle(Event::Woken),
            }
        }
    }

    fn dispatch(&mut self, event: SimEvent) {
        match event {
            SimEvent::AtWorker(id, message) => self.at_worker(id, message),
            SimEvent::AtLink(id, message) => self.at_link(id, message),
            SimEvent::AtMaster(id, message) => self.at_master(id, message),
            SimEvent::BandDone { worker, thread } => self.band_done(worker, thread),
            SimEvent::Closed(id) => {
                if self.machines.contains_key(&id) {
                    self.disconnect(id);
                }
            }
            SimEvent::Recovered(id) => self.recover(id),
            SimEvent::Input => {
                self.request();
                let pause = SECOND as f64 / self.setup.input_rate;
                self.clock.schedule(self.clock.now + pause as u64, SimEvent::Input);
            }
            SimEvent::Request => self.request(),
            SimEvent::Fault => self.inject_fault(),
            SimEvent::Arbitrated { frame, segment, result } => {
                self.handle(Event::SegmentArbitrated { frame, segment, result });
            }
        }
    }

    fn perform(&mut self, action: Action, events: &mut VecDeque<Event>) {
        let checked = match action {
            Action::BeginFrame { frame } => self.shell.begin(frame, self.setup.size.1),
            Action::FrameDone { frame, elapsed, .. } => self.frame_done(frame, elapsed.as_nanos() as u64),
            Action::FrameDropped { frame } | Action::FrameFailed { frame } => {
                self.open.remove(&frame);
                self.shell.drop(frame)
            }
            Action::Announce { worker, frame } => {
                self.shell.announce(worker, frame);
                self.send_to_worker(worker, MasterMessage::Announce);
                Ok(())
            }
            Action::Grant { worker, lease } => self.grant(worker, lease),
            Action::Cancel { worker, before } => {
                self.shell.cancel(worker, before);
                self.send_to_worker(worker, MasterMessage::Cancel(before));
                Ok(())
            }
            Action::Ping { worker, nonce } => {
                self.send_to_worker(worker, MasterMessage::Ping(nonce));
                Ok(())
            }
            Action::Drain { worker } => {
                self.send_to_worker(worker, MasterMessage::Drain);
                Ok(())
            }
            Action::Disconnect { worker, .. } => {
                self.remove_worker(worker);
                Ok(())
            }
            Action::RecordDigest { worker, lease } => {
                self.shell.record_digest(worker, lease);
                Ok(())
            }
            Action::Verify { worker, lease } => {
                self.send_to_worker(worker, MasterMessage::Lease(lease));
                self.shell.verify(worker, lease)
            }
            Action::Arbitrate { frame, segment } => {
                let result = self.shell.arbitrate(frame, segment);
                self.clock.schedule(
                    self.clock.now + ARBITRATION_TIME,
                    SimEvent::Arbitrated { frame, segment, result },
                );
                Ok(())
            }
            Action::DropDigest { frame, segment } => {
                self.shell.drop_digest(frame, segment);
                Ok(())
            }
            Action::Ban { worker, .. } => {
                self.remove_worker(worker);
                self.counters.banned += 1;
                let (rejected, checked) = self.shell.ban(worker);
                events.extend(rejected);
                checked
            }
        };
        if let Err(what) = checked {
            self.violation.get_or_insert(what);
        }
    }

    fn grant(&mut self, worker: WorkerId, lease: Lease) -> Result<(), String> {
        self.counters.segments += 1;
        self.counters.repeated += u64::from(lease.attempt > 0);
        if self.shell.grant(worker, lease)? {
            let idle = self.counters.idle(self.clock.now);
            if let Some(open) = self.open.get_mut(&lease.frame) {
                open.idle_before = Some(idle);
            }
        }
        self.send_to_worker(worker, MasterMessage::Lease(lease));
        Ok(())
    }

    fn frame_done(&mut self, frame: FrameId, elapsed: u64) -> Result<(), String> {
        self.counters.wrong_frames += u64::from(self.shell.done(frame)?);
        if let Some(Open { requested_at, idle_before }) = self.open.remove(&frame) {
            let idle = idle_before.unwrap_or_else(|| self.counters.idle(self.clock.now));
            let idle = idle.max(self.idle_counted);
            self.idle_counted = self.counters.idle(self.clock.now);
            self.counters.complete(self.clock.now, idle, elapsed, self.clock.now - requested_at);
        }
        if self.setup.input_rate <= 0.0 && self.requests_more {
            self.clock.schedule(self.clock.now, SimEvent::Request);
        }
        Ok(())
    }
}
