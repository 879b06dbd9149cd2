//! Scenarios of policies, timeouts and requests, action by action. `transcript` describes the scripts.

use super::transcript::{expect, transcript};

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
fn rows_of_a_lost_worker_are_requeued_at_the_front() {
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
fn a_new_worker_finishes_the_frame_of_the_last_one() {
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
fn a_failing_worker_backs_off_and_gets_the_frame_announced_again() {
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
fn a_silent_worker_is_pinged_and_then_disconnected() {
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
1: disconnect (reconnect now), it has been silent for 10 s
2: ping 8
2: render 1.0 (attempt 1), rows 0+10
";
    assert_eq!(end, expected, "{log}");
}

#[test]
fn a_suspect_worker_gets_no_leases_until_it_is_heard() {
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
fn no_worker_is_disconnected_for_a_pause_of_the_master() {
    let log = transcript("static:10", "0 join 1 1\n0 frame 1 10x10\n60000 wake\n60100 done 1 1.0");
    assert!(!log.contains("disconnect") && log.contains("finished 1"), "{log}");
}

#[test]
fn the_latest_request_replaces_the_waiting_one() {
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
        drop 2
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
fn leases_of_dropped_requests_are_cancelled_at_once() {
    let script = "
        0 join 1 1
        0 frame 1 10x10
        0 frame 2 10x10
        1 drop-requests 3
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
        > 1 drop-requests 3
        drop 1
        drop 2
        1: cancel before 3
        > 1 frame 3 20x10
        begin 3
        1: frame 3
        1: render 3.0, rows 0+10
        > 5 done 1 1.0
        > 9 done 1 3.0
        finished 3 after 8 ms, 1 rays",
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
        drop 2
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
