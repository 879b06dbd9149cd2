//! One worker's leases, rests and round trips.

use super::*;

const SECOND: Duration = Duration::from_secs(1);

fn hold(worker: &mut Worker, segment: u32, at: Duration) -> Lease {
    let lease = Lease { frame: FrameId(1), segment, attempt: 0, first_row: segment * 8, row_count: 8 };
    let held = Held {
        lease,
        granted_at: at,
        bands: 1,
        work: 8.0,
        expected_at: None,
        deadline: Some(at + SECOND),
        audit: false,
    };
    worker.hold(at, held);
    lease
}

#[test]
fn what_arrives_slower_than_it_is_traced_counts_as_it_arrives() {
    let mut worker = Worker::new(1, HostId(1), Duration::ZERO);
    let leases = [0, 1, 2].map(|segment| hold(&mut worker, segment, Duration::ZERO));
    let cost = Cost { trace_ns: 1_000_000_000, ..Cost::default() };
    worker.finish(SECOND * 20, leases[0], cost, SECOND);
    assert_eq!(worker.speed.value(), Some(8.0), "its first segment waited for the scene");
    worker.finish(SECOND * 22, leases[1], cost, SECOND);
    worker.finish(SECOND * 24, leases[2], cost, SECOND);
    assert!((worker.speed.value().unwrap() - 4.0).abs() < 1e-9);
}

#[test]
fn who_is_late_rests_until_it_answers() {
    let mut worker = Worker::new(1, HostId(1), Duration::ZERO);
    let lease = hold(&mut worker, 0, Duration::ZERO);
    assert_eq!(worker.overdue_at(), Some(SECOND));
    assert_eq!(worker.lapse(SECOND), [(FrameId(1), 0)]);
    assert!(!worker.is_ready(SECOND) && worker.overdue_at().is_none());
    assert_eq!(worker.waited_for_since(), Some(Duration::ZERO));
    assert!(worker.finish(SECOND, lease, Cost::default(), SECOND).is_some());
    assert!(worker.is_ready(SECOND) && worker.waited_for_since().is_none());
}

#[test]
fn a_lease_is_finished_once_and_only_as_granted() {
    let mut worker = Worker::new(1, HostId(1), Duration::ZERO);
    let lease = hold(&mut worker, 0, Duration::ZERO);
    assert!(worker.finish(SECOND, Lease { attempt: 1, ..lease }, Cost::default(), SECOND).is_none());
    assert!(worker.finish(SECOND, lease, Cost::default(), SECOND).is_some());
    assert!(worker.finish(SECOND, lease, Cost::default(), SECOND).is_none());
}

#[test]
fn rests_double_up_to_a_limit_and_end_with_success() {
    let mut worker = Worker::new(1, HostId(1), Duration::ZERO);
    let mut now = Duration::ZERO;
    let mut rests = Vec::new();
    for _ in 0..7 {
        worker.fail(now);
        let until = worker.rested_at(now).unwrap();
        rests.push((until - now).as_secs());
        now = until;
    }
    assert_eq!(rests, [1, 2, 4, 8, 16, 30, 30]);
    let lease = hold(&mut worker, 0, now);
    worker.finish(now, lease, Cost::default(), SECOND);
    worker.fail(now);
    assert_eq!(worker.rested_at(now), Some(now + SECOND));
}

#[test]
fn only_the_open_ping_measures_the_round_trip() {
    let mut worker = Worker::new(1, HostId(1), Duration::ZERO);
    worker.pinged(SECOND, 5);
    worker.pong(SECOND * 2, 4);
    assert_eq!(worker.round_trip, None);
    worker.pong(SECOND * 3, 5);
    assert_eq!(worker.round_trip, Some(2.0));
    assert_eq!(worker.lost_at(), SECOND * 13);
}
