use std::time::Duration;

use rayfarm_protocol::{Cost, FrameId, Lease};

use super::*;
use crate::scheduler::{Action, Event, HostId, Reconnect, WorkerId};

mod properties;

const MS: u64 = 1_000_000;
const MILL: WorkerId = WorkerId(1);
const BARN: WorkerId = WorkerId(2);

/// Accounts with a clock in milliseconds.
struct Told {
    accounts: Accounts,
}

impl Told {
    /// Two workers that have been there for a while: one with two threads, one with one.
    fn new() -> Self {
        let mut told = Self { accounts: Accounts::default() };
        told.event(0, Event::WorkerJoined { worker: MILL, threads: 2, host: HostId(1) });
        told.event(0, Event::WorkerJoined { worker: BARN, threads: 1, host: HostId(1) });
        told.accounts.name(MILL, "mill");
        told
    }

    fn event(&mut self, ms: u64, event: Event) {
        self.accounts.event(Duration::from_millis(ms), &event);
    }

    fn action(&mut self, ms: u64, action: Action) {
        self.accounts.action(Duration::from_millis(ms), &action);
    }

    fn begin(&mut self, ms: u64, frame: u64) {
        self.action(ms, Action::BeginFrame { frame: FrameId(frame) });
    }

    fn grant(&mut self, ms: u64, worker: WorkerId, lease: Lease) {
        self.action(ms, Action::Grant { worker, lease });
    }

    fn done(&mut self, ms: u64, worker: WorkerId, lease: Lease, cost: Cost) {
        self.event(ms, Event::SegmentDone { worker, lease, cost });
    }

    fn frame(&mut self, ms: u64, frame: u64) -> FrameAccount {
        let done =
            Action::FrameDone { frame: FrameId(frame), cost: Cost::default(), elapsed: Duration::ZERO };
        self.action(ms, done);
        self.accounts.take_done()
    }
}

fn lease(frame: u64, segment: u32) -> Lease {
    Lease { frame: FrameId(frame), segment, attempt: 0, first_row: segment * 8, row_count: 8 }
}

/// Milliseconds of waiting at the worker, of being at it, and of tracing and encoding over all threads.
fn cost(wait: u64, span: u64, trace: u64, encode: u64) -> Cost {
    let [wait_ns, span_ns, trace_ns, encode_ns] = [wait, span, trace, encode].map(|ms| ms * MS);
    Cost { wait_ns, span_ns, trace_ns, encode_ns, ..Cost::default() }
}

fn in_ms(parts: Parts) -> [u64; PART_COUNT] {
    parts.values().map(|ns| ns / MS)
}

#[test]
fn a_frame_is_split_as_it_went() {
    let mut told = Told::new();
    told.begin(100, 1);
    told.grant(100, MILL, lease(1, 0));
    told.grant(100, BARN, lease(1, 1));
    // Of 20 ms: 1 waiting there, 15 at it with both threads most of the time, 1 to take the pixels in, 3 on the wire.
    told.accounts.taken_in(MILL, 500, Duration::from_millis(1));
    told.done(120, MILL, lease(1, 0), cost(1, 15, 24, 4));
    told.done(130, BARN, lease(1, 1), cost(0, 30, 30, 0));
    let FrameAccount { workers, segments } = told.frame(130, 1);
    assert_eq!(workers[0].parts.total(), 2 * 30 * MS);
    // trace, wait, encode, send, decode, idle tail, scene
    assert_eq!(in_ms(workers[0].parts), [24, 4, 4, 6, 2, 20, 0]);
    assert_eq!(in_ms(workers[1].parts), [30, 0, 0, 0, 0, 0, 0]);
    assert_eq!((workers[0].name.as_str(), workers[0].bytes, workers[0].rows), ("mill", 500, 8));
    assert_eq!(
        segments.iter().map(|note| (note.first_row, note.worker)).collect::<Vec<_>>(),
        [(0, 1), (8, 2)]
    );
}

#[test]
fn what_is_hidden_behind_tracing_costs_nothing() {
    let mut told = Told::new();
    told.begin(0, 1);
    // Two leases at a time: each takes 10 ms to trace and 5 ms to come back, during which the next one is traced.
    told.grant(0, BARN, lease(1, 0));
    told.grant(0, BARN, lease(1, 1));
    told.done(15, BARN, lease(1, 0), cost(0, 10, 10, 0));
    told.grant(15, BARN, lease(1, 2));
    told.done(25, BARN, lease(1, 1), cost(10, 10, 10, 0));
    told.done(35, BARN, lease(1, 2), cost(5, 10, 10, 0));
    let parts = told.frame(35, 1).workers[1].parts;
    assert_eq!(in_ms(parts), [30, 0, 0, 5, 0, 0, 0]);
}

#[test]
fn work_ahead_of_its_answer_finds_its_time_in_the_next_frame() {
    let mut told = Told::new();
    told.begin(0, 1);
    told.grant(0, BARN, lease(1, 0));
    told.done(10, BARN, lease(1, 0), cost(0, 10, 10, 0));
    told.grant(10, BARN, lease(2, 0));
    told.frame(10, 1);
    told.begin(10, 2);
    // It says that it has traced for 14 of 10 ms: it began before the master's clock knew.
    told.grant(10, BARN, lease(2, 1));
    told.done(20, BARN, lease(2, 0), cost(0, 14, 14, 0));
    assert_eq!(in_ms(told.frame(20, 2).workers[1].parts), [10, 0, 0, 0, 0, 0, 0]);
    told.begin(20, 3);
    told.done(30, BARN, lease(2, 1), cost(4, 6, 6, 0));
    assert_eq!(in_ms(told.frame(30, 3).workers[1].parts), [10, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn a_worker_that_fetches_the_scene_waits_for_the_scene() {
    let mut told = Told::new();
    told.begin(0, 1);
    told.grant(0, BARN, lease(1, 0));
    told.accounts.asset_wanted(Duration::from_millis(5), BARN);
    told.grant(5, MILL, lease(1, 1));
    told.done(10, MILL, lease(1, 1), cost(0, 5, 10, 0));
    let first = told.frame(20, 1).workers[1].parts;
    assert_eq!(in_ms(first), [0, 0, 0, 0, 0, 0, 20], "though it holds a lease");
    told.begin(20, 2);
    told.done(50, BARN, lease(1, 0), cost(22, 8, 8, 0));
    told.grant(50, BARN, lease(2, 0));
    told.done(60, BARN, lease(2, 0), cost(0, 10, 10, 0));
    assert_eq!(in_ms(told.frame(60, 2).workers[1].parts), [18, 0, 0, 0, 0, 0, 22]);
}

#[test]
fn work_in_vain_is_idle_tail() {
    let mut told = Told::new();
    told.begin(0, 1);
    told.grant(0, MILL, lease(1, 0));
    told.grant(10, BARN, Lease { attempt: 1, ..lease(1, 0) });
    told.done(30, MILL, lease(1, 0), cost(0, 30, 60, 0));
    told.action(30, Action::Cancel { worker: BARN, before: FrameId(2) });
    let barn = told.frame(30, 1).workers[1].parts;
    assert_eq!(in_ms(barn), [0, 0, 0, 0, 0, 30, 0], "10 without a lease, 20 with somebody else's rows");
}

#[test]
fn nobody_is_charged_for_time_before_the_first_frame_or_in_a_pause() {
    let mut told = Told::new();
    told.begin(500, 1);
    told.event(500, Event::PauseRequested { worker: BARN });
    told.event(540, Event::ResumeRequested { worker: BARN });
    let FrameAccount { workers, .. } = told.frame(550, 1);
    assert_eq!(in_ms(workers[0].parts), [0, 0, 0, 0, 0, 100, 0]);
    assert_eq!(in_ms(workers[1].parts), [0, 0, 0, 0, 0, 10, 0]);
    // Without a frame to render, all wait.
    told.begin(570, 2);
    assert_eq!(in_ms(told.frame(571, 2).workers[0].parts), [0, 40, 0, 0, 0, 2, 0]);
}

#[test]
fn who_leaves_is_in_the_account_of_the_frame_and_in_no_other() {
    let mut told = Told::new();
    told.begin(0, 1);
    told.grant(0, BARN, lease(1, 0));
    told.event(10, Event::WorkerLeft { worker: BARN });
    let (reason, reconnect) = (String::new(), Reconnect::Now);
    told.action(15, Action::Disconnect { worker: MILL, reason, reconnect });
    let FrameAccount { workers, .. } = told.frame(20, 1);
    assert_eq!(workers.iter().map(|worker| in_ms(worker.parts)[5]).collect::<Vec<_>>(), [30, 10]);
    told.begin(20, 2);
    assert_eq!(told.frame(30, 2).workers, []);
}

#[test]
fn rows_that_are_rendered_twice_are_noted_once() {
    let mut told = Told::new();
    told.begin(0, 1);
    told.grant(0, MILL, lease(1, 0));
    told.grant(0, BARN, Lease { attempt: 1, ..lease(1, 0) });
    told.done(5, BARN, Lease { attempt: 1, ..lease(1, 0) }, cost(0, 1, 1, 0));
    told.done(6, MILL, lease(1, 0), cost(0, 1, 1, 0));
    assert_eq!(told.frame(7, 1).segments.len(), 1);
}

#[test]
fn percentages_sum_to_a_hundred_to_the_last_digit() {
    let thirds = Parts { trace: 1, wait: 1, scene: 1, ..Parts::default() };
    assert_eq!(thirds.percent(), [33.334, 33.333, 0.0, 0.0, 0.0, 0.0, 33.333]);
    assert_eq!(Parts::default().percent(), [0.0; PART_COUNT]);
}
