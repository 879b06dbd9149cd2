//! A farm in virtual time, from a seed: workers of random speed join, crash, hang, fail, drain, answer twice and
//! answer late. First everything goes wrong (what holds, holds), then nothing does (what was asked for completes).

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use proptest::prelude::*;

use super::{Action, Cost, Event, FrameId, Lease, Scheduler, SegmentPolicy, WorkerId, check};

/// While this lasts, faults happen.
const FAULTY_US: u64 = 30_000_000;
/// By then, every frame asked for is complete: silence is noticed after 10 s, a rest lasts 30 s.
const DONE_BY_US: u64 = FAULTY_US + 60_000_000;
const HEIGHT: u32 = 100;

/// splitmix64: the whole run follows from its seed.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % sides
    }

    fn one_in(&mut self, n: u64) -> bool {
        self.roll(n) == 0
    }
}

struct SimWorker {
    us_per_row: u64,
    latency_us: u64,
    busy_until_us: u64,
    hangs: bool,
    announced: BTreeSet<FrameId>,
    cancelled_before: FrameId,
    granted: BTreeSet<Lease>,
}

enum Happening {
    Tell(Event),
    Reply(WorkerId, Lease),
    NextFault,
    NextRequest,
}

struct Farm {
    scheduler: Scheduler,
    dice: Dice,
    now_us: u64,
    agenda: BTreeMap<(u64, u64), Happening>,
    agenda_entries: u64,
    workers: BTreeMap<WorkerId, SimWorker>,
    last_worker: u64,
    requested: u64,
    /// Rows whose pixels arrived, of frames in flight.
    rows: BTreeMap<FrameId, BTreeSet<u32>>,
    ended: Vec<FrameId>,
    completed: Vec<FrameId>,
}

impl Farm {
    fn new(policy: SegmentPolicy, seed: u64) -> Self {
        Self {
            scheduler: Scheduler::new(policy, 1 << 20, 8),
            dice: Dice(seed),
            now_us: 0,
            agenda: BTreeMap::new(),
            agenda_entries: 0,
            workers: BTreeMap::new(),
            last_worker: 0,
            requested: 0,
            rows: BTreeMap::new(),
            ended: Vec::new(),
            completed: Vec::new(),
        }
    }

    fn plan(&mut self, in_us: u64, happening: Happening) {
        self.agenda_entries += 1;
        self.agenda.insert((self.now_us + in_us, self.agenda_entries), happening);
    }

    fn tell(&mut self, event: Event) {
        self.scheduler.handle(Duration::from_micros(self.now_us), event);
        assert_eq!(check::violated(&self.scheduler), None, "after {event:?} at {} us", self.now_us);
        while let Some(action) = self.scheduler.poll_action() {
            self.perform(action);
        }
    }

    /// Lives until a time, or until the agenda and the scheduler have nothing more to do.
    fn run(&mut self, until_us: u64) {
        let mut steps_at_once = 0;
        loop {
            let wake_us = self.scheduler.poll_timeout().map(|at| at.as_micros() as u64 + 1);
            let planned_us = self.agenda.first_key_value().map(|((at, _), _)| *at);
            let Some(next_us) = wake_us.into_iter().chain(planned_us).min().filter(|&at| at <= until_us)
            else {
                self.now_us = until_us;
                return;
            };
            steps_at_once = if next_us > self.now_us { 0 } else { steps_at_once + 1 };
            assert!(
                steps_at_once < 10_000,
                "the scheduler wants to be woken again and again at {next_us} us"
            );
            self.now_us = self.now_us.max(next_us);
            match planned_us.filter(|&at| at == next_us).and_then(|_| self.agenda.pop_first()) {
                Some((_, happening)) => self.happen(happening),
                None => self.tell(Event::Woken),
            }
        }
    }

    fn happen(&mut self, happening: Happening) {
        match happening {
            Happening::Tell(event) => self.tell(event),
            Happening::Reply(worker, lease) => self.reply(worker, lease),
            Happening::NextFault => self.fault(),
            Happening::NextRequest => {
                self.request();
                if self.now_us < FAULTY_US {
                    let pause_us = self.dice.roll(2_000_000);
                    self.plan(pause_us, Happening::NextRequest);
                }
            }
        }
    }

    fn request(&mut self) {
        self.requested += 1;
        let width = if self.dice.one_in(20) { 20 } else { 10 };
        self.tell(Event::FrameRequested { frame: FrameId(self.requested), width, height: HEIGHT });
    }

    fn join(&mut self, healthy: bool) {
        self.last_worker += 1;
        let id = WorkerId(self.last_worker);
        let us_per_row = if healthy { 1000 } else { 100 + self.dice.roll(20_000) };
        let worker = SimWorker {
            us_per_row,
            latency_us: self.dice.roll(5_000),
            busy_until_us: self.now_us,
            hangs: false,
            announced: BTreeSet::new(),
            cancelled_before: FrameId(0),
            granted: BTreeSet::new(),
        };
        self.workers.insert(id, worker);
        let threads = 1 + self.dice.roll(16) as u32;
        self.tell(Event::WorkerJoined { worker: id, threads });
    }

    fn fault(&mut self) {
        if self.now_us >= FAULTY_US {
            return;
        }
        let pause_us = self.dice.roll(400_000);
        self.plan(pause_us, Happening::NextFault);
        let nth = self.dice.roll(self.workers.len().max(1) as u64) as usize;
        let victim = self.workers.keys().nth(nth).copied();
        match (self.dice.roll(9), victim) {
            (0 | 1, _) | (_, None) => self.join(false),
            (2, Some(worker)) => {
                self.workers.remove(&worker);
                self.tell(Event::WorkerLeft { worker });
            }
            (3, Some(worker)) => self.workers.get_mut(&worker).unwrap().hangs = true,
            (4, Some(worker)) => self.tell(Event::WorkerDrains { worker }),
            (5, Some(worker)) => self.tell(Event::DrainRequested { worker }),
            (6, Some(worker)) => self.tell(Event::PauseRequested { worker }),
            (7, Some(worker)) => self.tell(Event::ResumeRequested { worker }),
            (_, Some(worker)) => {
                let frame = FrameId(self.requested.saturating_sub(self.dice.roll(3)));
                self.tell(Event::WorkerFailed { worker, frame });
            }
        }
    }

    /// A worker's pixels arrive, as the shell would let them: only for leases that this worker was granted.
    fn reply(&mut self, id: WorkerId, lease: Lease) {
        let Some(worker) = self.workers.get(&id).filter(|worker| !worker.hangs) else { return };
        if lease.frame < worker.cancelled_before || !worker.granted.contains(&lease) {
            return;
        }
        if let Some(rows) = self.rows.get_mut(&lease.frame) {
            rows.extend(lease.first_row..lease.first_row + lease.row_count);
        }
        self.tell(Event::SegmentDone { worker: id, lease, cost: Cost::default() });
    }

    fn perform(&mut self, action: Action) {
        match action {
            Action::BeginFrame { frame } => {
                assert!(self.rows.insert(frame, BTreeSet::new()).is_none());
            }
            Action::FrameDone { frame, .. } => {
                let rows = self.rows.remove(&frame).expect("a frame that has begun");
                assert_eq!(rows.len(), HEIGHT as usize, "{frame:?} was called complete");
                assert!(self.completed.last() < Some(&frame), "{frame:?} after {:?}", self.completed);
                self.completed.push(frame);
                self.ended.push(frame);
            }
            Action::FrameDropped { frame } => {
                self.rows.remove(&frame);
                assert!(!self.ended.contains(&frame), "{frame:?} ended twice");
                self.ended.push(frame);
            }
            Action::Announce { worker, frame } => {
                self.workers.get_mut(&worker).expect("a live worker").announced.insert(frame);
            }
            Action::Grant { worker, lease } => self.granted(worker, lease),
            Action::Cancel { worker, before } => {
                self.workers.get_mut(&worker).expect("a live worker").cancelled_before = before;
            }
            Action::Ping { worker, nonce } => {
                let known = self.workers.get(&worker).expect("a live worker");
                if !known.hangs {
                    let latency_us = 2 * known.latency_us;
                    self.plan(latency_us, Happening::Tell(Event::Pong { worker, nonce }));
                }
            }
            Action::Drain { worker } => {
                assert!(self.workers.contains_key(&worker), "{worker} is told to drain and is gone");
            }
            Action::Dismiss { worker, .. } => {
                self.workers.remove(&worker).expect("a live worker");
            }
        }
    }

    fn granted(&mut self, id: WorkerId, lease: Lease) {
        assert!(self.rows.contains_key(&lease.frame), "{lease:?} of a frame that is not in flight");
        let worker = self.workers.get_mut(&id).expect("a live worker");
        assert!(worker.announced.contains(&lease.frame), "{lease:?} was not announced");
        assert!(worker.cancelled_before <= lease.frame, "{lease:?} was cancelled before it was granted");
        worker.granted.insert(lease);
        let begins_us = worker.busy_until_us.max(self.now_us);
        worker.busy_until_us = begins_us + u64::from(lease.row_count) * worker.us_per_row;
        let mut in_us = worker.busy_until_us + 2 * worker.latency_us - self.now_us;
        if self.now_us < FAULTY_US && self.dice.one_in(20) {
            in_us += self.dice.roll(3_000_000);
        }
        self.plan(in_us, Happening::Reply(id, lease));
        if self.dice.one_in(10) {
            let later_us = in_us + self.dice.roll(100_000);
            self.plan(later_us, Happening::Reply(id, lease));
        }
    }
}

fn live_through(policy: SegmentPolicy, seed: u64) -> Result<(), TestCaseError> {
    let mut farm = Farm::new(policy, seed);
    farm.plan(0, Happening::NextFault);
    farm.plan(0, Happening::NextRequest);
    farm.run(FAULTY_US);

    farm.join(true);
    farm.run(DONE_BY_US);
    let all: Vec<FrameId> = (1..=farm.requested).map(FrameId).collect();
    farm.ended.sort();
    prop_assert_eq!(&farm.ended, &all, "every frame ends exactly once");
    prop_assert_eq!(farm.completed.last(), all.last(), "the latest request wins");
    prop_assert_eq!(farm.scheduler.progress(), None);

    farm.request();
    let ids: Vec<WorkerId> = farm.workers.keys().copied().collect();
    for worker in ids {
        farm.workers.remove(&worker);
        farm.tell(Event::WorkerLeft { worker });
    }
    prop_assert_eq!(farm.scheduler.workers().count(), 0);
    prop_assert_eq!(farm.scheduler.poll_timeout(), None, "nobody is left to wait for");
    farm.join(true);
    farm.run(DONE_BY_US + 2_000_000);
    prop_assert_eq!(farm.completed.last(), Some(&FrameId(farm.requested)), "the next worker finishes it");
    Ok(())
}

fn policies() -> impl Strategy<Value = SegmentPolicy> {
    prop_oneof![
        Just(SegmentPolicy::Adaptive),
        (1..40_u32).prop_map(SegmentPolicy::Static),
        (1..40_u32).prop_map(SegmentPolicy::Smart),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn every_frame_completes_whatever_the_workers_do(policy in policies(), seed: u64) {
        live_through(policy, seed)?;
    }
}

#[test]
fn the_same_seed_is_the_same_run() {
    let run = |seed| {
        let mut farm = Farm::new(SegmentPolicy::Adaptive, seed);
        farm.plan(0, Happening::NextFault);
        farm.plan(0, Happening::NextRequest);
        farm.run(FAULTY_US);
        (farm.completed, farm.agenda_entries, farm.dice.0)
    };
    assert_eq!(run(42), run(42));
    assert_ne!(run(42), run(43));
}
