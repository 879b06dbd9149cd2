//! Properties of accounts under random events: each nanosecond is attributed exactly once.

use proptest::prelude::*;

use super::super::span::{Mark, Span, What};
use super::*;

/// An event or action, with small numbers for workers and segments.
#[derive(Clone, Debug)]
enum Step {
    Join(u64, u32),
    Leave(u64),
    Grant(u64, u32),
    Answer(u64, u32, Cost, u64),
    Cancel(u64),
    Fail(u64),
    Asset(u64),
    Pause(u64, bool),
    Begin,
    Finish,
    Drop,
}

fn step() -> impl Strategy<Value = Step> {
    let worker = 1..4_u64;
    let huge = prop_oneof![4 => 0..50 * MS, 1 => any::<u64>()];
    let cost = (huge.clone(), huge.clone(), huge.clone(), huge).prop_map(
        |(trace_ns, wait_ns, encode_ns, span_ns)| Cost {
            trace_ns,
            wait_ns,
            encode_ns,
            span_ns,
            ..Cost::default()
        },
    );
    prop_oneof![
        (worker.clone(), 1..5_u32).prop_map(|(worker, threads)| Step::Join(worker, threads)),
        worker.clone().prop_map(Step::Leave),
        (worker.clone(), 0..6_u32).prop_map(|(worker, segment)| Step::Grant(worker, segment)),
        (worker.clone(), 0..6_u32).prop_map(|(worker, segment)| Step::Grant(worker, segment)),
        (worker.clone(), 0..6_u32, cost, 0..30 * MS)
            .prop_map(|(w, s, cost, decode)| Step::Answer(w, s, cost, decode)),
        worker.clone().prop_map(Step::Cancel),
        worker.clone().prop_map(Step::Fail),
        worker.clone().prop_map(Step::Asset),
        (worker, any::<bool>()).prop_map(|(worker, paused)| Step::Pause(worker, paused)),
        Just(Step::Begin),
        Just(Step::Finish),
        Just(Step::Drop),
    ]
}

impl Fixture {
    fn step(&mut self, ns: u64, frame: u64, step: &Step) {
        let now = Duration::from_nanos(ns);
        match *step {
            Step::Join(worker, threads) => {
                self.accounts.event(
                    now,
                    &Event::WorkerJoined {
                        worker: WorkerId(worker),
                        threads,
                        host: HostId(1),
                        trusted: true,
                    },
                );
            }
            Step::Leave(worker) => self.accounts.event(now, &Event::WorkerLeft { worker: WorkerId(worker) }),
            Step::Grant(worker, segment) => {
                let action = Action::Grant { worker: WorkerId(worker), lease: lease(frame, segment) };
                self.accounts.action(now, &action);
            }
            Step::Answer(worker, segment, cost, decode) => {
                let worker = WorkerId(worker);
                self.accounts.received(worker, 10, Duration::from_nanos(decode));
                self.accounts.event(now, &Event::SegmentDone { worker, lease: lease(frame, segment), cost });
            }
            Step::Cancel(worker) => {
                let action = Action::Cancel { worker: WorkerId(worker), before: FrameId(frame) };
                self.accounts.action(now, &action);
            }
            Step::Fail(worker) => {
                let event = Event::WorkerFailed { worker: WorkerId(worker), frame: FrameId(frame) };
                self.accounts.event(now, &event);
            }
            Step::Asset(worker) => self.accounts.asset_requested(now, WorkerId(worker)),
            Step::Pause(worker, true) => {
                self.accounts.event(now, &Event::PauseRequested { worker: WorkerId(worker) });
            }
            Step::Pause(worker, false) => {
                self.accounts.event(now, &Event::ResumeRequested { worker: WorkerId(worker) });
            }
            Step::Begin => self.accounts.action(now, &Action::BeginFrame { frame: FrameId(frame) }),
            Step::Finish => {
                let (cost, elapsed) = (Cost::default(), Duration::ZERO);
                self.accounts.action(now, &Action::FrameDone { frame: FrameId(frame), cost, elapsed });
            }
            Step::Drop => self.accounts.action(now, &Action::FrameDropped { frame: FrameId(frame) }),
        }
    }
}

fn spans(accounts: &mut Accounts) -> Vec<Span> {
    let marks = std::iter::from_fn(|| accounts.poll_mark());
    marks.filter_map(|mark| if let Mark::Span(span) = mark { Some(span) } else { None }).collect()
}

/// Whether the spans of one track are disjoint or nested.
fn nested(mut spans: Vec<Span>) -> bool {
    spans.sort_by_key(|span| (span.from, std::cmp::Reverse(span.to), matches!(span.what, What::Part(_))));
    let mut open: Vec<Duration> = Vec::new();
    spans.iter().all(|span| {
        while open.last().is_some_and(|&end| end <= span.from) {
            open.pop();
        }
        let fits = open.last().is_none_or(|&end| span.to <= end);
        open.push(span.to);
        fits && span.from <= span.to
    })
}

proptest! {
    /// Each worker's parts sum to its thread time in every frame, except for time under unanswered leases, whatever costs the
    /// workers claim.
    #[test]
    fn every_nanosecond_is_attributed_once(steps in prop::collection::vec((0..20 * MS, step()), 1..80)) {
        let mut fixture = Fixture { accounts: Accounts::default() };
        fixture.accounts.event(Duration::ZERO, &Event::WorkerJoined { worker: WorkerId(9), threads: 3, host: HostId(1), trusted: true });
        let (mut now, mut frame, mut begun, mut settled) = (0, 1, None, 0);
        for (passed, step) in steps {
            now += passed;
            fixture.step(now, frame, &step);
            match step {
                Step::Begin => { begun.get_or_insert(now); }
                Step::Finish | Step::Drop => {
                    let account = fixture.accounts.take_done();
                    for worker in &account.workers {
                        let sum: f64 = worker.parts.percent().iter().sum();
                        prop_assert!(worker.parts.total() == 0 || (sum - 100.0).abs() < 1e-9, "{worker:?}");
                    }
                    let own = account.workers.iter().filter(|worker| worker.id == 9);
                    settled += own.map(|worker| worker.parts.total()).sum::<u64>();
                    frame += 1;
                }
                _ => {}
            }
        }
        let end = Action::FrameDone { frame: FrameId(frame), cost: Cost::default(), elapsed: Duration::ZERO };
        fixture.accounts.action(Duration::from_nanos(now), &end);
        let own = fixture.accounts.take_done().workers.into_iter().find(|worker| worker.id == 9).unwrap();
        settled += own.parts.total() + fixture.accounts.unsettled(WorkerId(9));
        prop_assert_eq!(settled, begun.map_or(0, |begun| 3 * (now - begun)));
    }

    #[test]
    fn a_busy_workers_parts_sum_to_its_time(steps in prop::collection::vec((0..20 * MS, step()), 1..80)) {
        let mut fixture = Fixture { accounts: Accounts::default() };
        fixture.accounts.event(Duration::ZERO, &Event::WorkerJoined { worker: WorkerId(1), threads: 3, host: HostId(1), trusted: true });
        fixture.begin(0, 1);
        let (mut now, mut frame, mut settled) = (0, 1, 0);
        // The worker stays connected and is never paused, so all its time is in its accounts.
        let steps = steps.into_iter().filter(|(_, step)| {
            !matches!(step, Step::Join(1, _) | Step::Leave(1) | Step::Pause(1, _))
        });
        for (passed, step) in steps {
            now += passed;
            fixture.step(now, frame, &step);
            if matches!(step, Step::Finish) {
                let account = fixture.accounts.take_done();
                settled += account.workers.iter().filter(|w| w.id == 1).map(|w| w.parts.total()).sum::<u64>();
                frame += 1;
            }
        }
        let end = Action::FrameDone { frame: FrameId(frame), cost: Cost::default(), elapsed: Duration::ZERO };
        fixture.accounts.action(Duration::from_nanos(now), &end);
        let account = fixture.accounts.take_done();
        settled += account.workers.iter().find(|worker| worker.id == 1).unwrap().parts.total();
        prop_assert_eq!(settled + fixture.accounts.unsettled(WorkerId(1)), 3 * now);
    }

    #[test]
    fn spans_of_a_timeline_are_nested(steps in prop::collection::vec((0..20 * MS, step()), 1..80)) {
        let mut fixture = Fixture { accounts: Accounts::default() };
        fixture.accounts.keep_marks();
        let (mut now, mut frame) = (0, 1);
        for (passed, step) in steps {
            now += passed;
            fixture.step(now, frame, &step);
            frame += u64::from(matches!(step, Step::Finish | Step::Drop));
        }
        let spans = spans(&mut fixture.accounts);
        for track in [None, Some(WorkerId(1)), Some(WorkerId(2)), Some(WorkerId(3))] {
            let own: Vec<Span> = spans.iter().filter(|span| span.worker == track).cloned().collect();
            prop_assert!(nested(own.clone()), "{own:#?}");
        }
    }
}
