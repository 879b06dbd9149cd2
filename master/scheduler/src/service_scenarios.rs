//! Scenarios of workers that are to wait or to leave.

use super::transcript::expect;

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
        1: goodbye for good, it drains, and has finished its segments
        > 4 join 2 1
        2: frame 1
        2: render 1.2, rows 20+10
        > 5 done 2 1.2
        finished 1 after 5 ms, 3 rays",
    );
}

#[test]
fn a_worker_that_shall_leave_is_told_and_goes_when_it_has_finished() {
    let script = "
        0 join 1 1
        0 frame 1 10x30
        1 retire 1
        1 retire 1
        1 resume 1
        2 done 1 1.0
        3 done 1 1.1";
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
        > 1 retire 1
        1: drain
        > 1 retire 1
        > 1 resume 1
        > 2 done 1 1.0
        > 3 done 1 1.1
        1: goodbye for good, it drains, and has finished its segments",
    );
}

#[test]
fn a_paused_worker_gets_nothing_new_and_others_may_repeat_what_it_holds() {
    let script = "
        0 join 1 1
        0 frame 1 10x30
        1 pause 1
        2 done 1 1.0
        3 join 2 1
        4 done 2 1.2
        5 done 2 1.1
        6 frame 2 10x10
        6 leave 2
        7 resume 1";
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
        > 1 pause 1
        > 2 done 1 1.0
        > 3 join 2 1
        2: frame 1
        2: render 1.2, rows 20+10
        > 4 done 2 1.2
        2: render 1.1 (attempt 1), rows 10+10
        > 5 done 2 1.1
        1: cancel before 2
        finished 1 after 5 ms, 3 rays
        > 6 frame 2 10x10
        begin 2
        2: frame 2
        2: render 2.0, rows 0+10
        > 6 leave 2
        > 7 resume 1
        1: frame 2
        1: render 2.0 (attempt 1), rows 0+10",
    );
}
