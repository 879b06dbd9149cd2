//! Scenarios of verification, action by action. `transcript` describes the scripts.

use super::transcript::expect;

#[test]
fn second_renderings_go_to_other_workers_and_pictures_do_not_wait() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 10x20
        5 done 1 1.0
        6 done 2 1.1
        8 verified 1 1.3 same
        9 verified 2 1.2 same";
    expect(
        "static:10, verify 100 1",
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
        > 5 done 1 1.0
        record digest 1.2, rows 0+10 of 1
        1: render 1.1 (attempt 1), rows 10+10
        2: verify 1.2, rows 0+10
        > 6 done 2 1.1
        record digest 1.3, rows 10+10 of 2
        1: cancel before 2
        finished 1 after 6 ms, 2 rays
        1: frame 1
        1: verify 1.3, rows 10+10
        > 8 verified 1 1.3 same
        drop digest 1.3
        > 9 verified 2 1.2 same
        drop digest 1.2",
    );
}

#[test]
fn a_worker_with_wrong_pixels_is_banned_and_its_rows_in_flight_are_requeued() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 10x30
        5 done 1 1.0
        6 done 2 1.1
        7 verified 2 1.3 different
        8 arbitrated 1.3 wrong right
        8 reject 1 0+10
        9 done 2 1.0
        9 done 2 1.2";
    expect(
        "static:10, verify 100 1",
        script,
        "
        > 0 join 1 1
        > 0 join 2 1
        > 0 frame 1 10x30
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        2: frame 1
        2: render 1.1, rows 10+10
        1: render 1.2, rows 20+10
        > 5 done 1 1.0
        record digest 1.3, rows 0+10 of 1
        2: verify 1.3, rows 0+10
        > 6 done 2 1.1
        record digest 1.4, rows 10+10 of 2
        1: verify 1.4, rows 10+10
        > 7 verified 2 1.3 different
        arbitrate 1.3
        2: render 1.2 (attempt 1), rows 20+10
        > 8 arbitrated 1.3 wrong right
        drop digest 1.3
        1: ban, it sent wrong pixels: rows 0+10 of frame 1 differ from the master's rendering
        arbitrate 1.4
        > 8 reject 1 0+10
        2: render 1.0 (attempt 1), rows 0+10
        > 9 done 2 1.0
        record digest 1.5, rows 0+10 of 2
        > 9 done 2 1.2
        record digest 1.6, rows 20+10 of 2
        finished 1 after 9 ms, 3 rays",
    );
}

#[test]
fn verifications_of_a_lost_worker_go_to_another() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 10x30
        5 done 1 1.0
        6 join 3 1
        7 leave 2
        8 done 3 1.1
        9 verified 3 1.3 same";
    expect(
        "static:10, verify 100 1",
        script,
        "
        > 0 join 1 1
        > 0 join 2 1
        > 0 frame 1 10x30
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        2: frame 1
        2: render 1.1, rows 10+10
        1: render 1.2, rows 20+10
        > 5 done 1 1.0
        record digest 1.3, rows 0+10 of 1
        2: verify 1.3, rows 0+10
        > 6 join 3 1
        3: frame 1
        3: render 1.1 (attempt 1), rows 10+10
        > 7 leave 2
        3: verify 1.3, rows 0+10
        > 8 done 3 1.1
        record digest 1.4, rows 10+10 of 3
        1: verify 1.4, rows 10+10
        > 9 verified 3 1.3 same
        drop digest 1.3
        3: render 1.2 (attempt 1), rows 20+10",
    );
}

#[test]
fn a_lone_worker_is_verified_by_the_master() {
    let script = "
        0 join 1 1
        0 frame 1 10x20
        5 done 1 1.0
        6 done 1 1.1
        7 arbitrated 1.2 right right
        8 arbitrated 1.3 right right";
    expect(
        "static:10, verify 100 1",
        script,
        "
        > 0 join 1 1
        > 0 frame 1 10x20
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        1: render 1.1, rows 10+10
        > 5 done 1 1.0
        record digest 1.2, rows 0+10 of 1
        arbitrate 1.2
        > 6 done 1 1.1
        record digest 1.3, rows 10+10 of 1
        finished 1 after 6 ms, 2 rays
        > 7 arbitrated 1.2 right right
        drop digest 1.2
        arbitrate 1.3
        > 8 arbitrated 1.3 right right
        drop digest 1.3",
    );
}

#[test]
fn verifications_for_the_master_do_not_expire() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 10x10
        1 pause 2
        5 done 1 1.0
        5 frame 2 10x10
        6 done 1 2.0
        6 frame 3 10x10
        7 done 1 3.0
        8 arbitrated 1.1 right right";
    expect(
        "static:10, verify 100 1",
        script,
        "
        > 0 join 1 1
        > 0 join 2 1
        > 0 frame 1 10x10
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        2: frame 1
        2: render 1.0 (attempt 1), rows 0+10
        > 1 pause 2
        > 5 done 1 1.0
        record digest 1.1, rows 0+10 of 1
        2: cancel before 2
        finished 1 after 5 ms, 1 rays
        arbitrate 1.1
        > 5 frame 2 10x10
        begin 2
        1: frame 2
        1: render 2.0, rows 0+10
        > 6 done 1 2.0
        record digest 2.1, rows 0+10 of 1
        finished 2 after 1 ms, 1 rays
        > 6 frame 3 10x10
        begin 3
        1: frame 3
        1: render 3.0, rows 0+10
        > 7 done 1 3.0
        record digest 3.1, rows 0+10 of 1
        finished 3 after 1 ms, 1 rays
        > 8 arbitrated 1.1 right right
        drop digest 1.1
        arbitrate 2.1",
    );
}

#[test]
fn unfinished_verifications_are_dropped_two_frames_later() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 10x10
        5 done 1 1.0
        5 frame 2 10x10
        6 done 1 2.0
        6 frame 3 10x10
        7 done 1 3.0";
    expect(
        "static:10, verify 100 1",
        script,
        "
        > 0 join 1 1
        > 0 join 2 1
        > 0 frame 1 10x10
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        2: frame 1
        2: render 1.0 (attempt 1), rows 0+10
        > 5 done 1 1.0
        record digest 1.1, rows 0+10 of 1
        2: cancel before 2
        finished 1 after 5 ms, 1 rays
        2: frame 1
        2: verify 1.1, rows 0+10
        > 5 frame 2 10x10
        begin 2
        1: frame 2
        1: render 2.0, rows 0+10
        > 6 done 1 2.0
        record digest 2.1, rows 0+10 of 1
        finished 2 after 1 ms, 1 rays
        2: frame 2
        2: verify 2.1, rows 0+10
        > 6 frame 3 10x10
        begin 3
        1: frame 3
        1: render 3.0, rows 0+10
        > 7 done 1 3.0
        record digest 3.1, rows 0+10 of 1
        drop digest 1.1
        finished 3 after 1 ms, 1 rays
        2: frame 3
        2: verify 3.1, rows 0+10",
    );
}

#[test]
fn a_worker_of_another_host_renders_second() {
    let script = "
        0 join 1 1 7
        0 join 2 1 7
        0 join 3 1 8
        0 frame 1 10x30
        5 done 1 1.0
        6 done 2 1.1
        7 done 3 1.2";
    expect(
        "static:10, verify 100 1",
        script,
        "
        > 0 join 1 1 7
        > 0 join 2 1 7
        > 0 join 3 1 8
        > 0 frame 1 10x30
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        2: frame 1
        2: render 1.1, rows 10+10
        3: frame 1
        3: render 1.2, rows 20+10
        > 5 done 1 1.0
        record digest 1.3, rows 0+10 of 1
        1: render 1.1 (attempt 1), rows 10+10
        3: verify 1.3, rows 0+10
        > 6 done 2 1.1
        record digest 1.4, rows 10+10 of 2
        2: render 1.2 (attempt 1), rows 20+10
        > 7 done 3 1.2
        record digest 1.5, rows 20+10 of 3
        1: cancel before 2
        2: cancel before 2
        finished 1 after 7 ms, 3 rays
        1: frame 1
        1: verify 1.5, rows 20+10
        3: verify 1.4, rows 10+10",
    );
}

#[test]
fn failed_verifications_go_to_the_master() {
    let script = "
        0 join 1 1
        0 join 2 1
        0 frame 1 10x10
        5 done 1 1.0
        6 fail 2 1";
    expect(
        "static:10, verify 100 1",
        script,
        "
        > 0 join 1 1
        > 0 join 2 1
        > 0 frame 1 10x10
        begin 1
        1: frame 1
        1: render 1.0, rows 0+10
        2: frame 1
        2: render 1.0 (attempt 1), rows 0+10
        > 5 done 1 1.0
        record digest 1.1, rows 0+10 of 1
        2: cancel before 2
        finished 1 after 5 ms, 1 rays
        2: frame 1
        2: verify 1.1, rows 0+10
        > 6 fail 2 1
        arbitrate 1.1",
    );
}
