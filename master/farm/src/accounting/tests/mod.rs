//! Accounts of scripted frames.

use std::time::Duration;

use rayfarm_protocol::{Cost, FrameId, Lease};
use rayfarm_scheduler::{Action, Event, HostId, Reconnect, WorkerId};

use super::*;

mod properties;

const MS: u64 = 1_000_000;
const MILL: WorkerId = WorkerId(1);
const BARN: WorkerId = WorkerId(2);

/// Accounts with a clock in milliseconds.
struct Fixture {
    accounts: Accounts,
}

impl Fixture {
    /// Two connected workers, one with two threads and one with one.
    fn new() -> Self {
        let mut fixture = Self { accounts: Accounts::default() };
        fixture.event(0, Event::WorkerJoined { worker: MILL, threads: 2, host: HostId(1), trusted: true });
        fixture.event(0, Event::WorkerJoined { worker: BARN, threads: 1, host: HostId(1), trusted: true });
        fixture.accounts.name(MILL, "mill");
        fixture
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

/// A cost in milliseconds: waiting and span of the lease, tracing and encoding over all threads.
fn cost(wait: u64, span: u64, trace: u64, encode: u64) -> Cost {
    let [wait_ns, span_ns, trace_ns, encode_ns] = [wait, span, trace, encode].map(|ms| ms * MS);
    Cost { wait_ns, span_ns, trace_ns, encode_ns, ..Cost::default() }
}

fn in_ms(parts: Parts) -> [u64; PART_COUNT] {
    parts.values().map(|ns| ns / MS)
}

#[test]
fn the_time_of_a_frame_is_split_into_parts() {
    let mut fixture = Fixture::new();
    fixture.begin(100, 1);
    fixture.grant(100, MILL, lease(1, 0));
    fixture.grant(100, BARN, lease(1, 1));
    // Of 20 ms: 1 waiting at the worker, 15 rendering with both threads most of the time, 1 decoding, 3 on the wire.
    fixture.accounts.received(MILL, 500, Duration::from_millis(1));
    fixture.done(120, MILL, lease(1, 0), cost(1, 15, 24, 4));
    fixture.done(130, BARN, lease(1, 1), cost(0, 30, 30, 0));
    let FrameAccount { workers, segments } = fixture.frame(130, 1);
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
fn sending_during_tracing_is_not_counted() {
    let mut fixture = Fixture::new();
    fixture.begin(0, 1);
    // Two leases at a time: each takes 10 ms to trace and 5 ms to come back, during which the next one is traced.
    fixture.grant(0, BARN, lease(1, 0));
    fixture.grant(0, BARN, lease(1, 1));
    fixture.done(15, BARN, lease(1, 0), cost(0, 10, 10, 0));
    fixture.grant(15, BARN, lease(1, 2));
    fixture.done(25, BARN, lease(1, 1), cost(10, 10, 10, 0));
    fixture.done(35, BARN, lease(1, 2), cost(5, 10, 10, 0));
    let parts = fixture.frame(35, 1).workers[1].parts;
    assert_eq!(in_ms(parts), [30, 0, 0, 5, 0, 0, 0]);
}

#[test]
fn work_before_its_reply_counts_for_the_next_frame() {
    let mut fixture = Fixture::new();
    fixture.begin(0, 1);
    fixture.grant(0, BARN, lease(1, 0));
    fixture.done(10, BARN, lease(1, 0), cost(0, 10, 10, 0));
    fixture.grant(10, BARN, lease(2, 0));
    fixture.frame(10, 1);
    fixture.begin(10, 2);
    // It reports 14 ms of tracing in 10 ms: it started the lease before the master noted the previous reply.
    fixture.grant(10, BARN, lease(2, 1));
    fixture.done(20, BARN, lease(2, 0), cost(0, 14, 14, 0));
    assert_eq!(in_ms(fixture.frame(20, 2).workers[1].parts), [10, 0, 0, 0, 0, 0, 0]);
    fixture.begin(20, 3);
    fixture.done(30, BARN, lease(2, 1), cost(4, 6, 6, 0));
    assert_eq!(in_ms(fixture.frame(30, 3).workers[1].parts), [10, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn the_transfer_of_the_scene_counts_as_scene() {
    let mut fixture = Fixture::new();
    fixture.begin(0, 1);
    fixture.grant(0, BARN, lease(1, 0));
    fixture.accounts.asset_requested(Duration::from_millis(5), BARN);
    fixture.grant(5, MILL, lease(1, 1));
    fixture.done(10, MILL, lease(1, 1), cost(0, 5, 10, 0));
    let first = fixture.frame(20, 1).workers[1].parts;
    assert_eq!(in_ms(first), [0, 0, 0, 0, 0, 0, 20], "although it holds a lease");
    fixture.begin(20, 2);
    fixture.done(50, BARN, lease(1, 0), cost(22, 8, 8, 0));
    fixture.grant(50, BARN, lease(2, 0));
    fixture.done(60, BARN, lease(2, 0), cost(0, 10, 10, 0));
    assert_eq!(in_ms(fixture.frame(60, 2).workers[1].parts), [18, 0, 0, 0, 0, 0, 22]);
}

#[test]
fn work_in_vain_counts_as_idle_tail() {
    let mut fixture = Fixture::new();
    fixture.begin(0, 1);
    fixture.grant(0, MILL, lease(1, 0));
    fixture.grant(10, BARN, Lease { attempt: 1, ..lease(1, 0) });
    fixture.done(30, MILL, lease(1, 0), cost(0, 30, 60, 0));
    fixture.action(30, Action::Cancel { worker: BARN, before: FrameId(2) });
    let barn = fixture.frame(30, 1).workers[1].parts;
    assert_eq!(
        in_ms(barn),
        [0, 0, 0, 0, 0, 30, 0],
        "10 ms without a lease, 20 ms with rows of another worker"
    );
}

#[test]
fn time_before_the_first_frame_and_in_a_pause_is_not_counted() {
    let mut fixture = Fixture::new();
    fixture.begin(500, 1);
    fixture.event(500, Event::PauseRequested { worker: BARN });
    fixture.event(540, Event::ResumeRequested { worker: BARN });
    let FrameAccount { workers, .. } = fixture.frame(550, 1);
    assert_eq!(in_ms(workers[0].parts), [0, 0, 0, 0, 0, 100, 0]);
    assert_eq!(in_ms(workers[1].parts), [0, 0, 0, 0, 0, 10, 0]);
    // Without a requested frame, all workers wait.
    fixture.begin(570, 2);
    assert_eq!(in_ms(fixture.frame(571, 2).workers[0].parts), [0, 40, 0, 0, 0, 2, 0]);
}

#[test]
fn a_disconnected_worker_is_in_the_account_of_one_frame() {
    let mut fixture = Fixture::new();
    fixture.begin(0, 1);
    fixture.grant(0, BARN, lease(1, 0));
    fixture.event(10, Event::WorkerLeft { worker: BARN });
    let (reason, reconnect) = (String::new(), Reconnect::Now);
    fixture.action(15, Action::Disconnect { worker: MILL, reason, reconnect });
    let FrameAccount { workers, .. } = fixture.frame(20, 1);
    assert_eq!(workers.iter().map(|worker| in_ms(worker.parts)[5]).collect::<Vec<_>>(), [30, 10]);
    fixture.begin(20, 2);
    assert_eq!(fixture.frame(30, 2).workers, []);
}

#[test]
fn rows_rendered_twice_are_noted_once() {
    let mut fixture = Fixture::new();
    fixture.begin(0, 1);
    fixture.grant(0, MILL, lease(1, 0));
    fixture.grant(0, BARN, Lease { attempt: 1, ..lease(1, 0) });
    fixture.done(5, BARN, Lease { attempt: 1, ..lease(1, 0) }, cost(0, 1, 1, 0));
    fixture.done(6, MILL, lease(1, 0), cost(0, 1, 1, 0));
    assert_eq!(fixture.frame(7, 1).segments.len(), 1);
}

#[test]
fn percentages_sum_to_exactly_100() {
    let thirds = Parts { trace: 1, wait: 1, scene: 1, ..Parts::default() };
    assert_eq!(thirds.percent(), [33.334, 33.333, 0.0, 0.0, 0.0, 0.0, 33.333]);
    assert_eq!(Parts::default().percent(), [0.0; PART_COUNT]);
}
