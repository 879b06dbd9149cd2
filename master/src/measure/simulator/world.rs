//! The farm: events into the scheduler, actions out of it, messages over the links.

use std::collections::{BTreeMap, VecDeque};

use super::clock::{Clock, Down, Happening};
use super::dice::Dice;
use super::link::Lane;
use super::machine::Machine;
use super::shell::Shell;
use super::tally::{Measured, Tally};
use super::{SECOND, Setup};
use crate::scheduler::{Action, Event, FrameId, HostId, Lease, Scheduler, WorkerId, check};

/// Nobody waits longer for a measurement.
const PATIENCE: u64 = 3600 * SECOND;
/// Steps without the time going on: more is a scheduler that wants to be woken for ever.
const MAX_STEPS_AT_ONCE: u32 = 100_000;
/// What leases ask for at most, as the protocol has it.
const MAX_SEGMENT_BYTES: u64 = 32 << 20;
/// What it takes the master to trace a segment itself.
const JUDGEMENT: u64 = SECOND / 10;
/// Requests open at a time: the frame being rendered and the one after it.
const OPEN_REQUESTS: u64 = 2;

/// A frame on its way.
#[derive(Clone, Copy, Debug)]
struct Open {
    requested_at: u64,
    /// Idle work up to when its last row was leased.
    idle_before: Option<f64>,
}

/// Everything.
#[derive(Debug)]
pub(crate) struct World {
    pub(crate) setup: Setup,
    pub(crate) clock: Clock,
    pub(crate) dice: Dice,
    pub(crate) scheduler: Scheduler,
    pub(crate) shell: Shell,
    pub(crate) machines: BTreeMap<WorkerId, Machine>,
    pub(crate) tally: Tally,
    /// The first thing that was not as it must be.
    pub(crate) violation: Option<String>,
    /// Whether the invariants are checked after every event.
    pub(crate) checking: bool,
    pub(crate) requested: u64,
    pub(crate) faults: bool,
    /// Whether a complete frame is followed by a request for the next one.
    pub(crate) requests_more: bool,
    open: BTreeMap<FrameId, Open>,
    /// Sums of row costs of frames, by row.
    pub(super) costs: BTreeMap<u64, Vec<f64>>,
    last_worker: u64,
    /// Idle work up to when the last frame was complete: a tail is counted once.
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
            dice: Dice::new(setup.seed),
            scheduler,
            shell: Shell::default(),
            machines: BTreeMap::new(),
            tally: Tally::default(),
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

    /// Speeds of the workers in any order: evenly between the slowest and the fastest, 1 on average.
    fn speeds(&mut self) -> Vec<f64> {
        let (count, spread) = (self.setup.workers, self.setup.spread.max(1.0));
        let slowest = 2.0 / (1.0 + spread);
        let step = if count > 1 { (spread - 1.0) * slowest / f64::from(count - 1) } else { 0.0 };
        let first = if count > 1 { slowest } else { 1.0 };
        let mut speeds: Vec<f64> = (0..count).map(|n| first + step * f64::from(n)).collect();
        self.dice.shuffle(&mut speeds);
        speeds
    }

    /// See [`super::measure`].
    pub(crate) fn measure(mut self) -> Option<Measured> {
        let warm_up = 2 + self.setup.frames / 5;
        self.begin();
        self.run(PATIENCE, |world| world.tally.frames >= warm_up);
        self.tally.restart(self.clock.now);
        self.idle_counted = 0.0;
        self.open.values_mut().for_each(|open| open.idle_before = open.idle_before.map(|_| 0.0));
        let frames = self.setup.frames;
        self.run(PATIENCE, |world| world.tally.frames >= frames);
        let measured = self.tally.measured(self.clock.now, self.setup.frame_seconds);
        (measured.frames >= frames && self.violation.is_none()).then_some(measured)
    }

    /// Healthy workers join, and the first frames are asked for.
    pub(crate) fn begin(&mut self) {
        for speed in self.speeds() {
            self.join(speed);
        }
        for _ in 0..OPEN_REQUESTS {
            self.request();
        }
        if self.setup.input_rate > 0.0 {
            self.clock.plan(0, Happening::Input);
        }
    }

    pub(crate) fn join(&mut self, speed: f64) -> WorkerId {
        self.last_worker += 1;
        let id = WorkerId(self.last_worker);
        let machine = Machine::new(speed, self.setup.threads, self.setup.round_trip / 2);
        self.machines.insert(id, machine);
        self.tally.power += speed;
        self.shell.join(id);
        if self.last_worker <= u64::from(self.setup.liars) {
            self.corrupt(id);
        }
        let host = if self.last_worker <= u64::from(self.setup.neighbours) { 0 } else { self.last_worker };
        let threads = self.setup.threads;
        self.tell(Event::WorkerJoined { worker: id, threads, host: HostId(host.into()) });
        id
    }

    /// From now on, a worker lies.
    pub(crate) fn corrupt(&mut self, id: WorkerId) {
        self.shell.liars.insert(id, self.setup.lie);
    }

    /// Workers that have ever joined.
    pub(crate) fn joined(&self) -> u64 {
        self.last_worker
    }

    /// A connection ends: both sides forget it.
    pub(crate) fn part(&mut self, id: WorkerId) {
        if let Some(machine) = self.machines.remove(&id) {
            let tracing: f64 = machine.threads.iter().flatten().map(|band| band.speed).sum();
            self.tally.trace(self.clock.now, -tracing);
            self.tally.power -= machine.speed;
        }
        self.shell.leave(id);
    }

    pub(crate) fn lose(&mut self, worker: WorkerId) {
        self.part(worker);
        self.tell(Event::WorkerLeft { worker });
    }

    pub(crate) fn request(&mut self) {
        self.requested += 1;
        let frame = FrameId(self.requested);
        self.open.insert(frame, Open { requested_at: self.clock.now, idle_before: None });
        let (width, height) = self.setup.size;
        self.tell(Event::FrameRequested { frame, width, height, tile_rows: self.setup.tile_rows });
    }

    /// Tells the scheduler, and does what it says.
    pub(crate) fn tell(&mut self, event: Event) {
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

    /// Lives until a time, until something holds, or until an invariant does not.
    pub(crate) fn run(&mut self, until: u64, enough: impl Fn(&Self) -> bool) {
        let mut steps_at_once = 0;
        while self.violation.is_none() && !enough(self) {
            let wake = self.scheduler.poll_timeout().map(|at| at.as_nanos() as u64);
            let planned = self.clock.next_at();
            let Some(next) = wake.into_iter().chain(planned).min().filter(|&at| at <= until) else {
                self.clock.now = self.clock.now.max(until);
                return;
            };
            steps_at_once = if next > self.clock.now { 0 } else { steps_at_once + 1 };
            if steps_at_once > MAX_STEPS_AT_ONCE {
                self.violation = Some("the scheduler wants to be woken for ever".to_owned());
            }
            self.clock.now = self.clock.now.max(next);
            match planned.filter(|&at| at <= next).and_then(|_| self.clock.pop()) {
                Some(happening) => self.happen(happening),
                None => self.tell(Event::Woken),
            }
        }
    }

    fn happen(&mut self, happening: Happening) {
        match happening {
            Happening::AtWorker(id, message) => self.at_worker(id, message),
            Happening::AtLink(id, message) => self.at_link(id, message),
            Happening::AtMaster(id, message) => self.at_master(id, message),
            Happening::BandDone { worker, thread } => self.band_done(worker, thread),
            Happening::Closed(id) => {
                if self.machines.contains_key(&id) {
                    self.lose(id);
                }
            }
            Happening::Recovered(id) => self.recover(id),
            Happening::Input => {
                self.request();
                let pause = SECOND as f64 / self.setup.input_rate;
                self.clock.plan(self.clock.now + pause as u64, Happening::Input);
            }
            Happening::Request => self.request(),
            Happening::Fault => self.fault(),
            Happening::Judged { frame, segment, verdict } => {
                self.tell(Event::SegmentArbitrated { frame, segment, result: verdict });
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
                self.send(worker, Down::Announce);
                Ok(())
            }
            Action::Grant { worker, lease } => self.grant(worker, lease),
            Action::Cancel { worker, before } => {
                self.shell.cancel(worker, before);
                self.send(worker, Down::Cancel(before));
                Ok(())
            }
            Action::Ping { worker, nonce } => {
                self.send(worker, Down::Ping(nonce));
                Ok(())
            }
            Action::Drain { worker } => {
                self.send(worker, Down::Drain);
                Ok(())
            }
            Action::Disconnect { worker, .. } => {
                self.part(worker);
                Ok(())
            }
            Action::RecordDigest { worker, lease } => {
                self.shell.seal(worker, lease);
                Ok(())
            }
            Action::Verify { worker, lease } => {
                self.send(worker, Down::Lease(lease));
                self.shell.verify(worker, lease)
            }
            Action::Arbitrate { frame, segment } => {
                let verdict = self.shell.judge(frame, segment);
                self.clock.plan(self.clock.now + JUDGEMENT, Happening::Judged { frame, segment, verdict });
                Ok(())
            }
            Action::DropDigest { frame, segment } => {
                self.shell.unseal(frame, segment);
                Ok(())
            }
            Action::Ban { worker, .. } => {
                self.part(worker);
                self.tally.expelled += 1;
                let (rejected, checked) = self.shell.expel(worker);
                events.extend(rejected);
                checked
            }
        };
        if let Err(what) = checked {
            self.violation.get_or_insert(what);
        }
    }

    fn grant(&mut self, worker: WorkerId, lease: Lease) -> Result<(), String> {
        self.tally.segments += 1;
        self.tally.repeated += u64::from(lease.attempt > 0);
        if self.shell.grant(worker, lease)? {
            let idle = self.tally.idle(self.clock.now);
            if let Some(open) = self.open.get_mut(&lease.frame) {
                open.idle_before = Some(idle);
            }
        }
        self.send(worker, Down::Lease(lease));
        Ok(())
    }

    fn frame_done(&mut self, frame: FrameId, elapsed: u64) -> Result<(), String> {
        self.tally.wrong_frames += u64::from(self.shell.done(frame)?);
        if let Some(Open { requested_at, idle_before }) = self.open.remove(&frame) {
            let idle = idle_before.unwrap_or_else(|| self.tally.idle(self.clock.now));
            let idle = idle.max(self.idle_counted);
            self.idle_counted = self.tally.idle(self.clock.now);
            self.tally.complete(self.clock.now, idle, elapsed, self.clock.now - requested_at);
        }
        if self.setup.input_rate <= 0.0 && self.requests_more {
            self.clock.plan(self.clock.now, Happening::Request);
        }
        Ok(())
    }
}
