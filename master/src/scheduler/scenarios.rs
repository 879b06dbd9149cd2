//! Scenarios as transcripts: what is told to the scheduler (`>`), and exactly what it answers.
//!
//! A line of a script is `MILLISECONDS COMMAND`: `frame N WxH`, `join W THREADS`, `leave W`, `drain W`,
//! `done W FRAME.SEGMENT`, `fail W FRAME`, `pong W NONCE`, `wake`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

use super::{Action, Cost, Event, FrameId, Lease, Scheduler, SegmentPolicy, WorkerId};

/// Runs a script and writes the transcript.
fn transcript(policy: &str, script: &str) -> String {
    let mut scheduler = Scheduler::new(policy.parse().unwrap(), 1 << 20);
    let mut granted = BTreeMap::new();
    let mut log = String::new();
    for line in script.lines().map(str::trim).filter(|line| !line.is_empty()) {
        writeln!(log, "> {line}").unwrap();
        let (at_ms, command) = line.split_once(' ').unwrap();
        let now = Duration::from_millis(at_ms.parse().unwrap());
        scheduler.handle(now, event(command, &granted));
        while let Some(action) = scheduler.poll_action() {
            if let Action::Grant { worker, lease } = &action {
                granted.insert((*worker, lease.frame, lease.segment), *lease);
            }
            writeln!(log, "{}", spoken(&action)).unwrap();
        }
    }
    log
}

fn event(command: &str, granted: &BTreeMap<(WorkerId, FrameId, u32), Lease>) -> Event {
    let words: Vec<&str> = command.split(' ').collect();
    let number = |word: &str| word.parse::<u64>().unwrap();
    let pair = |word: &str, by| word.split_once(by).map(|(a, b)| (number(a), number(b) as u32)).unwrap();
    let worker = WorkerId(words.get(1).map_or(0, |word| number(word)));
    match words[..] {
        ["frame", frame, size] => {
            let (width, height) = pair(size, 'x');
            Event::FrameRequested { frame: FrameId(number(frame)), width: width as u32, height }
        }
        ["join", _, threads] => Event::WorkerJoined { worker, threads: number(threads) as u32 },
        ["leave", _] => Event::WorkerLeft { worker },
        ["drain", _] => Event::WorkerDrains { worker },
        ["done", _, segment] => {
            let (frame, segment) = pair(segment, '.');
            let lease = granted[&(worker, FrameId(frame), segment)];
            Event::SegmentDone { worker, lease, cost: Cost { primary: 1, ..Cost::default() } }
        }
        ["fail", _, frame] => Event::WorkerFailed { worker, frame: FrameId(number(frame)) },
        ["pong", _, nonce] => Event::Pong { worker, nonce: number(nonce) },
        ["wake"] => Event::Woken,
        _ => panic!("no such command: {command}"),
    }
}

fn spoken(action: &Action) -> String {
    match action {
        Action::BeginFrame { frame } => format!("begin {}", frame.0),
        Action::FrameDone { frame, cost, elapsed } => {
            format!("finished {} after {} ms, {} rays", frame.0, elapsed.as_millis(), cost.primary)
        }
        Action::FrameDropped { frame } => format!("forget {}", frame.0),
        Action::Announce { worker, frame } => format!("{}: frame {}", worker.0, frame.0),
        Action::Grant { worker, lease } => {
            let Lease { frame, segment, attempt, first_row, row_count } = lease;
            let again = if *attempt > 0 { format!(" (attempt {attempt})") } else { String::new() };
            format!("{}: render {}.{segment}{again}, rows {first_row}+{row_count}", worker.0, frame.0)
        }
        Action::Cancel { worker, before } => format!("{}: cancel before {}", worker.0, before.0),
        Action::Ping { worker, nonce } => format!("{}: ping {nonce}", worker.0),
        Action::Dismiss { worker, reason } => format!("{}: goodbye, {reason}", worker.0),
    }
}

/// Compares without regard to indentation.
#[track_caller]
fn expect(policy: &str, script: &str, expected: &str) {
    let expected: String = expected.trim().lines().map(|line| format!("{}\n", line.trim())).collect();
    let actual = transcript(policy, script);
    assert_eq!(actual, expected, "\nthe transcript was:\n{actual}");
}

#[test]
fn static_segments_go_out_in_order_two_to_each_worker() {
    let script = "
        0 join 1 4
        0 join 2 4
        0 frame 1 100x35
        10 done 1 1.0
        20 done 2 1.1
        20 done 1 1.2
        20 done 2 1.3";
    expect(
        "static:10",
        script,
        "
        > 0 join 1 4
        > 0 join 2 4
        > 0 frame 1 100x35
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        2: frame 1
        2: render 1.1, rows 10+10
        1: render 1.2, rows 20+10
        2: render 1.3, rows 30+5
        > 10 done 1 1.0
        > 20 done 2 1.1
        > 20 done 1 1.2
        1: render 1.3 (attempt 1), rows 30+5
        > 20 done 2 1.3
        1: cancel before 2
        finished 1 after 20 ms, 4 rays",
    );
}

#[test]
fn smart_halves_the_last_segments() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 100x30
        5 done 1 1.0
        6 done 2 1.1";
    expect(
        "smart:10",
        script,
        "
        > 0 join 1 1
        > 0 join 2 1
        > 0 frame 1 100x30
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        2: frame 1
        2: render 1.1, rows 10+10
        1: render 1.2, rows 20+5
        2: render 1.3, rows 25+5
        > 5 done 1 1.0
        > 6 done 2 1.1",
    );
}

#[test]
fn a_lost_workers_rows_go_first_to_those_who_stay() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 10x50
        5 leave 1
        6 done 2 1.1
        7 done 2 1.3
        8 done 1 1.0
        9 done 2 1.0
        9 done 2 1.2
        9 done 2 1.4";
    expect(
        "static:10",
        script,
        "
        > 0 join 1 1
        > 0 join 2 1
        > 0 frame 1 10x50
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        2: frame 1
        2: render 1.1, rows 10+10
        1: render 1.2, rows 20+10
        2: render 1.3, rows 30+10
        > 5 leave 1
        > 6 done 2 1.1
        2: render 1.0 (attempt 1), rows 0+10
        > 7 done 2 1.3
        2: render 1.2 (attempt 1), rows 20+10
        > 8 done 1 1.0
        > 9 done 2 1.0
        2: render 1.4, rows 40+10
        > 9 done 2 1.2
        > 9 done 2 1.4
        finished 1 after 9 ms, 5 rays",
    );
}

#[test]
fn the_last_worker_leaves_and_the_next_one_finishes() {
    let script = "
        0 frame 1 10x20
        0 join 1 1
        5 leave 1
        1000 join 2 1
        1010 done 2 1.0
        1020 done 2 1.1";
    expect(
        "static:10",
        script,
        "
        > 0 frame 1 10x20
        begin 1
        > 0 join 1 1
        1: frame 1
        1: render 1.0, rows 0+10
        1: render 1.1, rows 10+10
        > 5 leave 1
        > 1000 join 2 1
        2: frame 1
        2: render 1.0 (attempt 1), rows 0+10
        2: render 1.1 (attempt 1), rows 10+10
        > 1010 done 2 1.0
        > 1020 done 2 1.1
        finished 1 after 1020 ms, 2 rays",
    );
}

#[test]
fn a_worker_that_cannot_rests_and_is_told_of_the_frame_again() {
    let script = "
        0 join 1 1
        0 frame 1 10x10
        5 fail 1 1
        6 fail 1 1
        900 wake
        1005 wake
        1010 done 1 1.0";
    expect(
        "static:10",
        script,
        "
        > 0 join 1 1
        > 0 frame 1 10x10
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        > 5 fail 1 1
        > 6 fail 1 1
        > 900 wake
        > 1005 wake
        1: frame 1
        1: render 1.0 (attempt 1), rows 0+10
        > 1010 done 1 1.0
        finished 1 after 1010 ms, 1 rays",
    );
}

#[test]
fn a_silent_worker_is_asked_and_then_dismissed() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 10x20
        2000 wake
        2001 pong 2 1
        4000 wake
        4001 pong 2 3
        6000 wake
        6001 pong 2 5
        8000 wake
        8001 pong 2 7
        10000 wake";
    let log = transcript("static:10", script);
    let end = log.split("> 8001 pong 2 7\n").nth(1).unwrap();
    let expected = "> 10000 wake
1: goodbye, it has given no sign of life for 10 s
2: ping 8
2: render 1.0 (attempt 1), rows 0+10
";
    assert_eq!(end, expected, "{log}");
}

#[test]
fn a_suspect_gets_nothing_new_until_it_gives_a_sign_of_life() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 10x20
        2000 wake
        2001 pong 2 1
        3000 wake
        3001 done 2 1.1
        3002 done 2 1.0
        3003 frame 2 10x20
        3004 pong 1 0";
    expect(
        "static:10",
        script,
        "
        > 0 join 1 1
        > 0 join 2 1
        > 0 frame 1 10x20
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        2: frame 1
        2: render 1.1, rows 10+10
        > 2000 wake
        1: ping 0
        2: ping 1
        > 2001 pong 2 1
        > 3000 wake
        > 3001 done 2 1.1
        2: render 1.0 (attempt 1), rows 0+10
        > 3002 done 2 1.0
        1: cancel before 2
        finished 1 after 3002 ms, 2 rays
        > 3003 frame 2 10x20
        begin 2
        2: frame 2
        2: render 2.0, rows 0+10
        2: render 2.1, rows 10+10
        > 3004 pong 1 0
        1: frame 2
        1: render 2.0 (attempt 1), rows 0+10",
    );
}

#[test]
fn nobody_is_dismissed_for_the_masters_own_absence() {
    let log = transcript("static:10", "0 join 1 1\n0 frame 1 10x10\n60000 wake\n60100 done 1 1.0");
    assert!(!log.contains("goodbye") && log.contains("finished 1"), "{log}");
}

#[test]
fn the_latest_request_replaces_the_one_that_waits() {
    let script = "
        0 frame 1 10x10
        0 frame 2 10x10
        0 frame 3 10x10
        0 join 1 1
        5 done 1 1.0
        9 done 1 3.0";
    expect(
        "static:10",
        script,
        "
        > 0 frame 1 10x10
        begin 1
        > 0 frame 2 10x10
        > 0 frame 3 10x10
        forget 2
        > 0 join 1 1
        1: frame 1
        1: render 1.0, rows 0+10
        > 5 done 1 1.0
        finished 1 after 5 ms, 1 rays
        begin 3
        1: frame 3
        1: render 3.0, rows 0+10
        > 9 done 1 3.0
        finished 3 after 4 ms, 1 rays",
    );
}

#[test]
fn another_size_gives_up_what_came_before() {
    let script = "
        0 join 1 1
        0 frame 1 10x10
        0 frame 2 10x10
        1 frame 3 20x10
        5 done 1 1.0
        9 done 1 3.0";
    expect(
        "static:10",
        script,
        "
        > 0 join 1 1
        > 0 frame 1 10x10
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        > 0 frame 2 10x10
        > 1 frame 3 20x10
        forget 1
        1: cancel before 3
        forget 2
        begin 3
        1: frame 3
        1: render 3.0, rows 0+10
        > 5 done 1 1.0
        > 9 done 1 3.0
        finished 3 after 8 ms, 1 rays",
    );
}

#[test]
fn a_draining_worker_finishes_what_it_has() {
    let script = "
        0 join 1 1
        0 frame 1 10x30
        1 drain 1
        2 done 1 1.0
        3 done 1 1.1
        4 join 2 1
        5 done 2 1.2";
    expect(
        "static:10",
        script,
        "
        > 0 join 1 1
        > 0 frame 1 10x30
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        1: render 1.1, rows 10+10
        > 1 drain 1
        > 2 done 1 1.0
        > 3 done 1 1.1
        1: goodbye, it asked to leave and has finished its segments
        > 4 join 2 1
        2: frame 1
        2: render 1.2, rows 20+10
        > 5 done 2 1.2
        finished 1 after 5 ms, 3 rays",
    );
}

#[test]
fn under_adaptive_idle_workers_begin_the_next_frame() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 10x4
        0 frame 2 10x4
        1 frame 3 10x4
        5 done 1 1.0
        5 done 1 1.2
        7 done 2 1.1
        8 done 2 1.3";
    expect(
        "adaptive",
        script,
        "
        > 0 join 1 1
        > 0 join 2 1
        > 0 frame 1 10x4
        begin 1
        1: frame 1
        1: render 1.0, rows 0+1
        2: frame 1
        2: render 1.1, rows 1+1
        1: render 1.2, rows 2+1
        2: render 1.3, rows 3+1
        > 0 frame 2 10x4
        > 1 frame 3 10x4
        forget 2
        > 5 done 1 1.0
        begin 3
        1: frame 3
        1: render 3.0, rows 0+1
        > 5 done 1 1.2
        1: render 3.1, rows 1+1
        > 7 done 2 1.1
        2: frame 3
        2: render 3.2, rows 2+1
        > 8 done 2 1.3
        finished 1 after 8 ms, 4 rays
        2: render 3.3, rows 3+1",
    );
}

#[test]
fn adaptive_gives_the_faster_worker_more_rows_on_tile_boundaries() {
    let mut scheduler = Scheduler::new(SegmentPolicy::Adaptive, 1 << 24);
    let rows = drive_two(&mut scheduler, [1, 4], 6);
    let last: Vec<u32> = rows.last().copied().unwrap().into();
    assert!(last[1] > 2 * last[0], "rows of the worker and of one four times as fast, by frame: {rows:?}");
}

/// Renders frames of 512 rows with two workers whose speeds, in rows a millisecond, are given. Returns the rows that each did, by frame.
fn drive_two(scheduler: &mut Scheduler, speeds: [u32; 2], frames: u64) -> Vec<[u32; 2]> {
    for worker in [0, 1] {
        scheduler.handle(Duration::ZERO, Event::WorkerJoined { worker: WorkerId(worker), threads: 1 });
    }
    let mut now_us = 0;
    let mut rows = Vec::new();
    for frame in 1..=frames {
        let mut done = [0; 2];
        let mut queues: [Vec<Lease>; 2] = Default::default();
        let mut busy_until_us = [now_us; 2];
        let request = Event::FrameRequested { frame: FrameId(frame), width: 64, height: 512 };
        scheduler.handle(Duration::from_micros(now_us), request);
        'frame: loop {
            while let Some(action) = scheduler.poll_action() {
                match action {
                    Action::Grant { worker, lease } => {
                        assert!(lease.first_row % 8 == 0 && lease.row_count % 8 == 0, "{lease:?}");
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
        scheduler.handle(Duration::ZERO, Event::WorkerJoined { worker: WorkerId(1), threads: 1 });
        let request = Event::FrameRequested { frame: FrameId(1), width: 300, height: 100 };
        scheduler.handle(Duration::ZERO, request);
        while let Some(action) = scheduler.poll_action() {
            if let Action::Grant { lease, .. } = action {
                assert!(lease.row_count <= 3, "{policy}: {lease:?}");
            }
        }
    }
}
