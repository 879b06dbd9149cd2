//! The farm: events into the scheduler, actions out of it, messages over the links.

use std::collections::BTreeMap;

use super::clock::{Clock, Down, Happening, Up};
use super::dice::Dice;
use super::link::{Lane, bytes};
use super::machine::{Ailment, BAND_ROWS, Band, Machine};
use super::shell::{Answer, Shell};
use super::tally::{Measured, Tally};
use super::{SECOND, Setup};
use crate::scheduler::{Action, Cost, Event, FrameId, Lease, Scheduler, WorkerId, check};

/// Nobody waits longer for a measurement.
const PATIENCE: u64 = 3600 * SECOND;
/// Steps without the time going on: more is a scheduler that wants to be woken for ever.
const MAX_STEPS_AT_ONCE: u32 = 100_000;
/// What leases ask for at most, as the protocol has it.
const MAX_SEGMENT_BYTES: u64 = 32 << 20;
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
    costs: BTreeMap<u64, Vec<f64>>,
    last_worker: u64,
    /// Idle work up to when the last frame was complete: a tail is counted once.
    idle_counted: f64,
    master_in: Lane,
    master_out: Lane,
    master: Lane,
}

impl World {
    pub(crate) fn new(setup: Setup) -> Self {
        let scheduler = Scheduler::new(setup.policy, MAX_SEGMENT_BYTES, BAND_ROWS)
            .with_pipeline(setup.pipeline)
            .with_tile_share(setup.tile_share);
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
        self.tell(Event::WorkerJoined { worker: id, threads: self.setup.threads });
        id
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
        self.tell(Event::FrameRequested { frame, width, height });
    }

    /// Tells the scheduler, and does what it says.
    pub(crate) fn tell(&mut self, event: Event) {
        self.scheduler.handle(self.clock.time(), event);
        if self.checking && self.violation.is_none() {
            let violated = check::violated(&self.scheduler);
            self.violation = violated.map(|what| format!("{what}, after {event:?}"));
        }
        while let Some(action) = self.scheduler.poll_action() {
            self.perform(action);
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
        }
    }

    fn at_worker(&mut self, id: WorkerId, message: Down) {
        let Some(machine) = self.machines.get_mut(&id) else { return };
        match (machine.ailment, message) {
            (Ailment::Vanished, _) => {}
            (Ailment::Stopped, _) => machine.unread.push(message),
            (Ailment::Stuck, Down::Lease(_)) => {}
            (_, Down::Lease(lease)) if self.faults && self.dice.one_in(200) => {
                self.say(id, Up::Failed(lease.frame));
            }
            (_, Down::Lease(lease)) => {
                machine.lease(lease);
                self.start(id);
            }
            (_, Down::Cancel(before)) => machine.cancel(before),
            (_, Down::Ping(nonce)) => self.say(id, Up::Pong(nonce)),
            (_, Down::Announce | Down::Drain) => {}
        }
    }

    /// Gives rows to idle threads.
    fn start(&mut self, id: WorkerId) {
        while let Some(machine) = self.machines.get_mut(&id) {
            if matches!(machine.ailment, Ailment::Stopped | Ailment::Vanished) {
                return;
            }
            let Some(thread) = machine.idle_thread() else { return };
            let Some((lease, rows)) = machine.next_band() else { return };
            let speed = machine.thread_speed();
            let last = rows.end == lease.first_row + lease.row_count;
            let lease_seconds = if last { self.setup.lease_cost as f64 / SECOND as f64 } else { 0.0 };
            let (work, cutting) = self.work(lease.frame, rows.clone());
            let nanoseconds = (((work + cutting) / speed + lease_seconds) * SECOND as f64) as u64;
            self.tally.cutting += cutting;
            self.tally.leases += lease_seconds * speed;
            self.tally.trace(self.clock.now, speed);
            let done_at = self.clock.now + nanoseconds;
            if let Some(machine) = self.machines.get_mut(&id) {
                machine.threads[thread] = Some(Band { lease, rows, nanoseconds, speed, stale: false });
            }
            self.clock.plan(done_at, Happening::BandDone { worker: id, thread });
        }
    }

    /// The work of rows, and what cutting their tiles adds to it.
    fn work(&mut self, frame: FrameId, rows: std::ops::Range<u32>) -> (f64, f64) {
        let height = self.setup.size.1;
        // Costs that never change are computed once.
        let key = if self.setup.costs.moves() { frame.0 } else { 0 };
        let costs = self.costs.entry(key).or_insert_with(|| {
            let mut sums = vec![0.0];
            let mut sum = 0.0;
            sums.extend(self.setup.costs.shares(frame.0, height).into_iter().map(|share| {
                sum += share;
                sum
            }));
            sums
        });
        let at = |row: u32| costs.get(row.min(height) as usize).copied().unwrap_or(0.0);
        let band_first = rows.start - rows.start % BAND_ROWS;
        let band_rows = (band_first + BAND_ROWS).min(height) - band_first;
        let left_out = 1.0 - f64::from(rows.end - rows.start) / f64::from(band_rows.max(1));
        let band = at(band_first + BAND_ROWS) - at(band_first);
        let work = (at(rows.end) - at(rows.start)) * self.setup.frame_seconds;
        let cutting = self.setup.tile_share * band * left_out.max(0.0) * self.setup.frame_seconds;
        while self.costs.len() > 16 {
            self.costs.pop_first();
        }
        (work, cutting)
    }

    fn band_done(&mut self, id: WorkerId, thread: usize) {
        let Some(machine) = self.machines.get_mut(&id) else { return };
        match machine.ailment {
            Ailment::Stopped => return machine.unfinished.push(thread),
            Ailment::Vanished => return,
            Ailment::Healthy | Ailment::Slow(_) | Ailment::Stuck => {}
        }
        let Some(band) = machine.threads.get_mut(thread).and_then(Option::take) else { return };
        self.tally.trace(self.clock.now, -band.speed);
        let stuck = machine.ailment == Ailment::Stuck;
        let whole = if band.stale { None } else { machine.finish(&band) };
        if let Some((lease, trace_ns)) = whole.filter(|_| !stuck) {
            let cost = Cost { trace_ns, primary: u64::from(lease.row_count), ..Cost::default() };
            self.deliver(id, lease, cost);
        }
        self.start(id);
    }

    /// A finished lease goes to the master; where faults happen, now and then late, twice or wrong.
    fn deliver(&mut self, id: WorkerId, lease: Lease, cost: Cost) {
        let fits = !(self.faults && self.dice.one_in(500));
        self.say(id, Up::Pixels { lease, cost, fits });
        if self.faults && self.dice.one_in(300) {
            self.say(id, Up::Pixels { lease, cost, fits });
        }
    }

    pub(crate) fn say(&mut self, id: WorkerId, message: Up) {
        let now = self.clock.now;
        let size = self.bytes(&message);
        let jitter = self.jitter();
        let rate = self.bytes_per_second();
        let Some(machine) = self.machines.get_mut(&id) else { return };
        // The first byte reaches the master's link a latency after it left; both links then carry it at once.
        let sent = machine.up.pass(now, size, rate);
        let begun = sent.saturating_sub((size / rate * SECOND as f64) as u64);
        let at = machine.up_order.arrive(begun + machine.latency + jitter);
        self.clock.plan(at, Happening::AtLink(id, message));
    }

    fn at_link(&mut self, id: WorkerId, message: Up) {
        let size = self.bytes(&message);
        let rate = self.bytes_per_second();
        let arrived = self.master_in.pass(self.clock.now, size, rate);
        self.tally.link_ns += size / rate * SECOND as f64;
        let costs = matches!(message, Up::Pixels { .. });
        let cost = if costs { self.setup.message_cost as f64 } else { 0.0 };
        self.tally.master_ns += cost;
        let at = self.master.pass(arrived, cost, SECOND as f64);
        self.clock.plan(at, Happening::AtMaster(id, message));
    }

    fn at_master(&mut self, worker: WorkerId, message: Up) {
        if !self.shell.books.contains_key(&worker) {
            return;
        }
        match message {
            Up::Pixels { lease, cost, fits } => match self.shell.answer(worker, &lease, fits) {
                Answer::Kept => self.tell(Event::SegmentDone { worker, lease, cost }),
                Answer::Late => {}
                Answer::Refused => self.lose(worker),
            },
            Up::Pong(nonce) => self.tell(Event::Pong { worker, nonce }),
            Up::Failed(frame) => {
                if let Some(book) = self.shell.books.get_mut(&worker) {
                    book.fail(frame);
                }
                self.tell(Event::WorkerFailed { worker, frame });
            }
            Up::Drain => self.tell(Event::WorkerDrains { worker }),
        }
    }

    fn perform(&mut self, action: Action) {
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
                if let Some(book) = self.shell.books.get_mut(&worker) {
                    book.cancel(before);
                }
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
            Action::Dismiss { worker, .. } => {
                self.part(worker);
                Ok(())
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
        self.shell.done(frame)?;
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

    fn send(&mut self, id: WorkerId, message: Down) {
        let size = match message {
            Down::Announce => bytes::ANNOUNCE,
            Down::Lease(_) | Down::Cancel(_) | Down::Ping(_) | Down::Drain => bytes::CONTROL,
        };
        let sent = self.master_out.pass(self.clock.now, size, self.bytes_per_second());
        let jitter = self.jitter();
        let Some(machine) = self.machines.get_mut(&id) else { return };
        let at = machine.down_order.arrive(sent + machine.latency + jitter);
        self.clock.plan(at, Happening::AtWorker(id, message));
    }

    fn bytes(&self, message: &Up) -> f64 {
        match message {
            Up::Pixels { lease, .. } => {
                let raw = f64::from(lease.row_count) * f64::from(self.setup.size.0) * 3.0;
                bytes::PIXELS_HEAD + raw / self.setup.compression
            }
            Up::Pong(_) | Up::Failed(_) | Up::Drain => bytes::CONTROL,
        }
    }

    fn bytes_per_second(&self) -> f64 {
        self.setup.link_bits / 8.0 * bytes::PAYLOAD_SHARE
    }

    fn jitter(&mut self) -> u64 {
        self.dice.roll(self.setup.jitter.saturating_add(1))
    }

    /// A machine is well again: it reads what it was sent meanwhile, and goes on.
    fn recover(&mut self, id: WorkerId) {
        let Some(machine) = self.machines.get_mut(&id) else { return };
        machine.ailment = Ailment::Healthy;
        let unread = std::mem::take(&mut machine.unread);
        let unfinished = std::mem::take(&mut machine.unfinished);
        for thread in unfinished {
            self.band_done(id, thread);
        }
        for message in unread {
            self.at_worker(id, message);
        }
        self.start(id);
    }
}
