//! How many rows whom: in proportion to speed, on tile boundaries, within what a message holds; and pictures of several sizes.

use std::collections::VecDeque;
use std::time::Duration;

use super::{Action, Cost, Event, FrameId, HostId, Lease, Scheduler, SegmentPolicy, WorkerId};

#[test]
fn adaptive_gives_the_faster_worker_more_rows_on_tile_boundaries() {
    let mut scheduler = Scheduler::new(SegmentPolicy::Adaptive, 1 << 24);
    let rows = drive_two(&mut scheduler, [1, 4], 6);
    let last: Vec<u32> = rows.last().copied().unwrap().into();
    assert!(last[1] > 2 * last[0], "rows of the worker and of one four times as fast, by frame: {rows:?}");
}

fn joined(worker: u64) -> Event {
    Event::WorkerJoined { worker: WorkerId(worker), threads: 1, host: HostId(worker.into()) }
}

/// Renders frames of 512 rows with two workers whose speeds, in rows a millisecond, are given. Returns the rows
/// that each did, by frame.
fn drive_two(scheduler: &mut Scheduler, speeds: [u32; 2], frames: u64) -> Vec<[u32; 2]> {
    for worker in [0, 1] {
        scheduler.handle(Duration::ZERO, joined(worker));
    }
    let mut now_us = 0;
    let mut rows = Vec::new();
    for frame in 1..=frames {
        let mut done = [0; 2];
        let mut queues: [Vec<Lease>; 2] = Default::default();
        let mut busy_until_us = [now_us; 2];
        let request = Event::FrameRequested { frame: FrameId(frame), width: 64, height: 512, tile_rows: 16 };
        scheduler.handle(Duration::from_micros(now_us), request);
        'frame: loop {
            while let Some(action) = scheduler.poll_action() {
                match action {
                    Action::Grant { worker, lease } => {
                        assert!(lease.first_row % 16 == 0 && lease.row_count % 16 == 0, "{lease:?}");
                        queues[worker.0 as usize].push(lease);
                    }
                    Action::FrameDone { .. } => break 'frame,
                    _ => {}
                }
            }
            let ends_us = |w: usize| {
                queues[w]
                    .first()
                    .map(|lease| busy_until_us[w] + u64::from(lease.row_count * 1000 / speeds[w]))
            };
            let next = [0, 1].into_iter().filter_map(|w| Some((ends_us(w)?, w))).min();
            let (at_us, w) = next.expect("rows are left and nobody renders");
            let lease = queues[w].remove(0);
            (now_us, busy_until_us[w]) = (at_us, at_us);
            done[w] += lease.row_count;
            let cost =
                Cost { trace_ns: u64::from(lease.row_count * 1_000_000 / speeds[w]), ..Cost::default() };
            let event = Event::SegmentDone { worker: WorkerId(w as u64), lease, cost };
            scheduler.handle(Duration::from_micros(now_us), event);
        }
        rows.push(done);
    }
    rows
}

#[test]
fn a_lease_never_asks_for_more_bytes_than_a_message_holds() {
    for policy in ["static:1000", "smart:1000", "adaptive"] {
        let mut scheduler = Scheduler::new(policy.parse().unwrap(), 3000);
        scheduler.handle(Duration::ZERO, joined(1));
        let request = Event::FrameRequested { frame: FrameId(1), width: 300, height: 100, tile_rows: 16 };
        scheduler.handle(Duration::ZERO, request);
        while let Some(action) = scheduler.poll_action() {
            if let Action::Grant { lease, .. } = action {
                assert!(lease.row_count <= 3, "{policy}: {lease:?}");
            }
        }
    }
}

/// What begins and what is complete, in turn, when frames 4 and 5 are asked for at once.
fn begun_and_done(second: (u32, u32)) -> Vec<Action> {
    let mut scheduler = Scheduler::new(SegmentPolicy::Adaptive, 1 << 24);
    drive_two(&mut scheduler, [1, 2], 3);
    let mut now = scheduler.handled_at;
    for (frame, (width, height)) in [(4, (64, 512)), (5, second)] {
        scheduler.handle(now, Event::FrameRequested { frame: FrameId(frame), width, height, tile_rows: 16 });
    }
    let (mut held, mut log) = (VecDeque::new(), Vec::new());
    loop {
        while let Some(action) = scheduler.poll_action() {
            match action {
                Action::Grant { worker, lease } => held.push_back((worker, lease)),
                Action::BeginFrame { .. } => log.push(action),
                Action::FrameDone { frame, .. } => {
                    log.push(Action::FrameDone { frame, cost: Cost::default(), elapsed: Duration::ZERO });
                }
                _ => {}
            }
        }
        let Some((worker, lease)) = held.pop_front() else { return log };
        now += Duration::from_millis(lease.row_count.into());
        let cost = Cost { trace_ns: u64::from(lease.row_count) * 1_000_000, ..Cost::default() };
        scheduler.handle(now, Event::SegmentDone { worker, lease, cost });
    }
}

/// The size may change from frame to frame: the frame on the way is completed, and the next begins after it.
#[test]
fn another_size_begins_after_the_frame_on_the_way_and_not_beside_it() {
    let begun = |frame| Action::BeginFrame { frame: FrameId(frame) };
    let done =
        |frame| Action::FrameDone { frame: FrameId(frame), cost: Cost::default(), elapsed: Duration::ZERO };
    for other in [(32, 256), (32, 512), (128, 512), (64, 700)] {
        assert_eq!(begun_and_done(other), [begun(4), done(4), begun(5), done(5)], "{other:?}");
    }
    assert_eq!(begun_and_done((64, 512)), [begun(4), begun(5), done(4), done(5)]);
}

/// Half as wide a row is half the work: a worker's speed is known in the rows of the next frame before it has rendered one.
#[test]
fn speeds_follow_the_width() {
    let mut scheduler = Scheduler::new(SegmentPolicy::Adaptive, 1 << 24);
    drive_two(&mut scheduler, [1, 4], 3);
    let speeds = |scheduler: &Scheduler| -> Vec<f64> {
        scheduler.workers.values().map(|worker| worker.speed.value().unwrap()).collect()
    };
    let before = speeds(&scheduler);
    let now = scheduler.handled_at;
    scheduler.handle(now, Event::FrameRequested { frame: FrameId(9), width: 32, height: 256, tile_rows: 16 });
    assert_eq!(speeds(&scheduler), before.iter().map(|speed| 2.0 * speed).collect::<Vec<_>>());
}
