//! Transitions of rows: leased, requeued, done, rejected.

use super::super::forecast::Tiles;
use super::*;

const A: WorkerId = WorkerId(1);
const B: WorkerId = WorkerId(2);

/// Ranges of rows that a reply is the first for: first row, and end row (exclusive).
fn fresh(frame: &mut Frame, lease: &Lease, cost: Cost) -> Vec<(u32, u32)> {
    frame.finish(lease, cost).into_iter().map(|rows| (rows.start, rows.end)).collect()
}

fn frame(rows: u32) -> Frame {
    let forecast = Forecast::new(vec![1.0; rows as usize], Tiles { rows: 16, share: 0.0 });
    Frame::new(FrameId(7), (10, rows), forecast, [RowRange::new(0, rows)])
}

#[test]
fn requeued_rows_keep_their_number_and_go_first() {
    let mut frame = frame(30);
    let revoked = frame.lease_front(A, 10).unwrap();
    frame.lease_front(B, 10).unwrap();
    frame.release(revoked.segment, A);
    let again = frame.lease_front(B, 10).unwrap();
    assert_eq!(again, Lease { attempt: 1, ..revoked });
}

#[test]
fn pieces_of_requeued_rows_are_new_segments() {
    let mut frame = frame(20);
    let revoked = frame.lease_front(A, 20).unwrap();
    frame.release(revoked.segment, A);
    let pieces = [frame.lease_front(A, 8).unwrap(), frame.lease_front(A, 20).unwrap()];
    assert_eq!(
        pieces.map(|p| (p.segment, p.attempt, p.first_row, p.row_count)),
        [(1, 0, 0, 8), (2, 0, 8, 12)]
    );
}

#[test]
fn a_segment_with_another_holder_is_not_requeued() {
    let mut frame = frame(8);
    let lease = frame.lease_front(A, 8).unwrap();
    let backup = frame.lease_to(lease.segment, B).unwrap();
    assert_eq!(backup.attempt, 1);
    frame.release(lease.segment, A);
    assert!(frame.queue.is_empty());
    frame.release(lease.segment, B);
    assert_eq!(frame.queue.len(), 1);
}

#[test]
fn only_the_first_result_counts() {
    let mut frame = frame(8);
    let lease = frame.lease_front(A, 8).unwrap();
    frame.lease_to(lease.segment, B).unwrap();
    let cost = Cost { primary: 80, ..Cost::default() };
    assert_eq!(fresh(&mut frame, &lease, cost), [(0, 8)]);
    assert!(fresh(&mut frame, &lease, cost).is_empty());
    assert_eq!((frame.rows_done, frame.cost().primary), (8, 80));
}

#[test]
fn a_late_result_finishes_the_pieces_of_its_rows() {
    let mut frame = frame(30);
    let late = frame.lease_front(A, 20).unwrap();
    frame.release(late.segment, A);
    let piece = frame.lease_front(B, 8).unwrap();
    let done = frame.lease_front(B, 4).unwrap();
    assert_eq!(fresh(&mut frame, &done, Cost { primary: 40, ..Cost::default() }), [(8, 12)]);
    assert_eq!(fresh(&mut frame, &late, Cost { primary: 200, ..Cost::default() }), [(0, 8), (12, 20)]);
    assert_eq!((frame.rows_done, frame.cost().primary), (20, 200));
    assert!(fresh(&mut frame, &piece, Cost::default()).is_empty());
    assert_eq!(frame.queue.iter().map(|range| (range.first, range.count)).collect::<Vec<_>>(), [(20, 10)]);
}

#[test]
fn rejected_rows_are_requeued_and_cost_once() {
    let mut frame = frame(30);
    let cost = Cost { primary: 100, ..Cost::default() };
    let leases = [
        frame.lease_front(A, 10).unwrap(),
        frame.lease_front(B, 10).unwrap(),
        frame.lease_front(A, 10).unwrap(),
    ];
    leases[..2].iter().for_each(|lease| assert_eq!(frame.finish(lease, cost).len(), 1));
    frame.reject(9..11);
    assert_eq!((frame.rows_done, frame.cost().primary), (0, 0));
    assert_eq!(frame.lease_front(B, 30), Some(Lease { attempt: 1, ..leases[0] }));
    frame.finish(&leases[2], cost);
    frame.reject(0..10);
    assert_eq!((frame.rows_done, frame.cost().primary), (10, 100), "rows that are not done are not rejected");
}

#[test]
fn a_finished_segment_resets_the_refusals() {
    let mut frame = frame(30);
    let lease = frame.lease_front(A, 20).unwrap();
    frame.refuse(B);
    frame.refuse(B);
    assert_eq!((frame.refusals(A), frame.refusals(B)), (0, 2));
    frame.finish(&lease, Cost::default());
    assert_eq!(frame.refusals(B), 0);
}

#[test]
fn a_single_row_is_not_halved() {
    let mut frame = frame(1);
    frame.halve_front();
    assert_eq!(frame.queue.len(), 1);
    assert!(frame.queue[0].halved && frame.queue[0].count == 1);
}

#[test]
fn costs_of_the_pieces_of_a_lease_sum_to_its_cost() {
    let cost = Cost { trace_ns: 1_000_003, primary: 19_200, shadow: 22_095, secondary: 7, ..Cost::default() };
    for cuts in [vec![0, 120], vec![0, 7, 120], vec![0, 1, 2, 64, 65, 119, 120]] {
        let mut sum = Cost::default();
        cuts.windows(2).for_each(|piece| sum += cost_share(cost, piece[0]..piece[1], 120));
        assert_eq!(sum, cost, "{cuts:?}");
    }
}
