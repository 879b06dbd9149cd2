//! Sizes of leases (in proportion to speed, on tile boundaries, within the limit of a message) and of pictures.

use std::collections::VecDeque;
use std::time::Duration;

use super::{Action, Cost, Event, FrameId, HostId, Lease, Scheduler, SegmentPolicy, WorkerId};

#[test]
fn adaptive_gives_the_faster_worker_more_rows_on_tile_boundaries() {
    let mut scheduler = Scheduler::new(SegmentPolicy::Adaptive, 1 << 24);
    let rows = drive_two(&mut scheduler, [1, 4], 6);
    let last: Vec<u32> = rows.last().copied().unwrap().into();
    assert!(last[1] > 2 * last[0], "rows of workers of speed 1 and 4, by frame: {rows:?}");
}

fn joined(worker: u64) -> Event {
    Event::WorkerJoined { worker: WorkerId(worker), threads: 1, host: HostId(worker.into()), trusted: true }
}

/// Renders frames of 512 rows with two workers; `speeds` are in rows per millisecond. Returns the rows of each worker,
/// by frame.
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
        let request = Event::FrameRequested {
            frame: FrameId(frame),
            width: 64,
            height: 512,
            row_bytes: 192,
            tile_rows: 16,
        };
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
            let (at_us, w) = next.expect("rows are left and no worker renders");
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

/// While the cost of a band is unknown, a lease has one band per thread: a row may take minutes.
#[test]
fn the_first_leases_have_one_band_per_thread_at_most() {
    for (threads, tile_rows, height, most) in [
        (1, 1, 1080, 1),
        (4, 1, 1080, 4),
        (1, 16, 1080, 16),
        (2, 16, 1080, 32),
        (64, 16, 1080, 128),
        (8, 16, 4, 1),
    ] {
        let mut scheduler = Scheduler::new(SegmentPolicy::Adaptive, 1 << 24);
        let join = Event::WorkerJoined { worker: WorkerId(1), threads, host: HostId(1), trusted: true };
        scheduler.handle(Duration::ZERO, join);
        let request =
            Event::FrameRequested { frame: FrameId(1), width: 1920, height, tile_rows, row_bytes: 1920 * 3 };
        scheduler.handle(Duration::ZERO, request);
        let rows: Vec<u32> = std::iter::from_fn(|| scheduler.poll_action())
            .filter_map(|action| match action {
                Action::Grant { lease, .. } => Some(lease.row_count),
                _ => None,
            })
            .collect();
        assert_eq!(rows.first(), Some(&most), "{threads} threads, bands of {tile_rows} rows: {rows:?}");
        assert!(rows.iter().all(|&rows| rows <= most), "{threads} threads: {rows:?}");
    }
}

#[test]
fn a_lease_never_exceeds_the_bytes_of_a_message() {
    for policy in ["static:1000", "smart:1000", "adaptive"] {
        let mut scheduler = Scheduler::new(policy.parse().unwrap(), 3000);
        scheduler.handle(Duration::ZERO, joined(1));
        let (mut now, mut most) = (Duration::ZERO, 0);
        // RGB8, then a format of 24 bytes a pixel, of the same size.
        for (frame, row_bytes, limit) in [(1, 900, 3), (2, 7200, 1), (3, 900, 3)] {
            let frame = FrameId(frame);
            let request = Event::FrameRequested { frame, width: 300, height: 100, row_bytes, tile_rows: 16 };
            scheduler.handle(now, request);
            while let Some(action) = scheduler.poll_action() {
                let Action::Grant { worker, lease } = action else { continue };
                assert!(lease.row_count <= limit, "{policy}: {lease:?} of rows of {row_bytes} bytes");
                most = most.max(lease.row_count);
                now += Duration::from_millis(1);
                let cost = Cost { trace_ns: 1_000_000, span_ns: 1_000_000, ..Cost::default() };
                scheduler.handle(now, Event::SegmentDone { worker, lease, cost });
            }
            assert!(scheduler.frames.is_empty(), "{policy}: frame {frame} is complete");
        }
        assert_eq!(most, 3, "{policy}");
    }
}

/// The order in which frames begin and complete when frames 4 and 5 are requested at once.
fn begun_and_done(second: (u32, u32)) -> Vec<Action> {
    let mut scheduler = Scheduler::new(SegmentPolicy::Adaptive, 1 << 24);
    drive_two(&mut scheduler, [1, 2], 3);
    let mut now = scheduler.handled_at;
    for (frame, (width, height)) in [(4, (64, 512)), (5, second)] {
        scheduler.handle(
            now,
            Event::FrameRequested { frame: FrameId(frame), width, height, row_bytes: 192, tile_rows: 16 },
        );
    }
    let (mut granted, mut log) = (VecDeque::new(), Vec::new());
    loop {
        while let Some(action) = scheduler.poll_action() {
            match action {
                Action::Grant { worker, lease } => granted.push_back((worker, lease)),
                Action::BeginFrame { .. } => log.push(action),
                Action::FrameDone { frame, .. } => {
                    log.push(Action::FrameDone { frame, cost: Cost::default(), elapsed: Duration::ZERO });
                }
                _ => {}
            }
        }
        let Some((worker, lease)) = granted.pop_front() else { return log };
        now += Duration::from_millis(lease.row_count.into());
        let cost = Cost { trace_ns: u64::from(lease.row_count) * 1_000_000, ..Cost::default() };
        scheduler.handle(now, Event::SegmentDone { worker, lease, cost });
    }
}

/// The size may change from frame to frame: the next frame then begins after the frame in flight is complete.
#[test]
fn a_frame_of_another_size_is_not_pipelined() {
    let begun = |frame| Action::BeginFrame { frame: FrameId(frame) };
    let done =
        |frame| Action::FrameDone { frame: FrameId(frame), cost: Cost::default(), elapsed: Duration::ZERO };
    for other in [(32, 256), (32, 512), (128, 512), (64, 700)] {
        assert_eq!(begun_and_done(other), [begun(4), done(4), begun(5), done(5)], "{other:?}");
    }
    assert_eq!(begun_and_done((64, 512)), [begun(4), begun(5), done(4), done(5)]);
}

/// A row of half the width is half the work, so speeds in rows double before the first lease of the next frame.
#[test]
fn speeds_follow_the_width() {
    let mut scheduler = Scheduler::new(SegmentPolicy::Adaptive, 1 << 24);
    drive_two(&mut scheduler, [1, 4], 3);
    let speeds = |scheduler: &Scheduler| -> Vec<f64> {
        scheduler.workers.values().map(|worker| worker.speed.value().unwrap()).collect()
    };
    let before = speeds(&scheduler);
    let now = scheduler.handled_at;
    scheduler.handle(
        now,
        Event::FrameRequested { frame: FrameId(9), width: 32, height: 256, row_bytes: 96, tile_rows: 16 },
    );
    assert_eq!(speeds(&scheduler), before.iter().map(|speed| 2.0 * speed).collect::<Vec<_>>());
}
