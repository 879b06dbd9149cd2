//! Leases, back-offs and round trips of one worker.

use super::*;

const SECOND: Duration = Duration::from_secs(1);

fn record(worker: &mut Worker, segment: u32, at: Duration) -> Lease {
    let lease = Lease { frame: FrameId(1), segment, attempt: 0, first_row: segment * 8, row_count: 8 };
    let active = ActiveLease {
        lease,
        granted_at: at,
        bands: 1,
        work: 8.0,
        expected_at: None,
        deadline: Some(at + SECOND),
        verifies: false,
    };
    worker.record(at, active);
    lease
}

#[test]
fn the_arrival_rate_counts_where_it_is_below_the_tracing_rate() {
    let mut worker = Worker::new(1, HostId(1), true, Duration::ZERO);
    let leases = [0, 1, 2].map(|segment| record(&mut worker, segment, Duration::ZERO));
    let cost = Cost { trace_ns: 1_000_000_000, ..Cost::default() };
    worker.finish(SECOND * 20, leases[0], cost, SECOND);
    assert_eq!(worker.speed.value(), Some(8.0), "its first segment waited for the scene");
    worker.finish(SECOND * 22, leases[1], cost, SECOND);
    worker.finish(SECOND * 24, leases[2], cost, SECOND);
    assert!((worker.speed.value().unwrap() - 4.0).abs() < 1e-9);
}

#[test]
fn a_worker_with_an_overdue_lease_backs_off_until_it_answers() {
    let mut worker = Worker::new(1, HostId(1), true, Duration::ZERO);
    let lease = record(&mut worker, 0, Duration::ZERO);
    assert_eq!(worker.next_deadline(), Some(SECOND));
    assert_eq!(worker.time_out(SECOND), [(FrameId(1), 0)]);
    assert!(!worker.is_ready(SECOND) && worker.next_deadline().is_none());
    assert_eq!(worker.stall, Some(Stall::new(Duration::ZERO)));
    assert!(worker.finish(SECOND, lease, Cost::default(), SECOND).is_some());
    assert!(worker.is_ready(SECOND) && worker.stall.is_none());
}

#[test]
fn a_lease_is_finished_once_and_only_as_granted() {
    let mut worker = Worker::new(1, HostId(1), true, Duration::ZERO);
    let lease = record(&mut worker, 0, Duration::ZERO);
    assert!(worker.finish(SECOND, Lease { attempt: 1, ..lease }, Cost::default(), SECOND).is_none());
    assert!(worker.finish(SECOND, lease, Cost::default(), SECOND).is_some());
    assert!(worker.finish(SECOND, lease, Cost::default(), SECOND).is_none());
}

#[test]
fn backoffs_double_up_to_a_limit_and_end_with_success() {
    let mut worker = Worker::new(1, HostId(1), true, Duration::ZERO);
    let mut now = Duration::ZERO;
    let mut backoffs = Vec::new();
    for _ in 0..7 {
        worker.back_off(now);
        let until = worker.backoff_until(now).unwrap();
        backoffs.push((until - now).as_secs());
        now = until;
    }
    assert_eq!(backoffs, [1, 2, 4, 8, 16, 30, 30]);
    let lease = record(&mut worker, 0, now);
    worker.finish(now, lease, Cost::default(), SECOND);
    worker.back_off(now);
    assert_eq!(worker.backoff_until(now), Some(now + SECOND));
}

#[test]
fn only_the_open_ping_measures_the_round_trip() {
    let mut worker = Worker::new(1, HostId(1), true, Duration::ZERO);
    worker.mark_pinged(SECOND, 5);
    worker.pong(SECOND * 2, 4);
    assert_eq!(worker.round_trip, None);
    worker.pong(SECOND * 3, 5);
    assert_eq!(worker.round_trip, Some(2.0));
    assert_eq!(worker.silence_deadline(), SECOND * 13);
}
