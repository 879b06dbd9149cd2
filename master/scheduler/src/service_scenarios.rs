//! Scenarios of paused and draining workers.

use super::transcript::expect;

#[test]
fn a_draining_worker_finishes_its_leases() {
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
        1: disconnect (reconnect never), it drains and holds no more leases
        > 4 join 2 1
        2: frame 1
        2: render 1.2, rows 20+10
        > 5 done 2 1.2
        finished 1 after 5 ms, 3 rays",
    );
}

#[test]
fn a_drain_request_notifies_the_worker_and_ends_with_its_leases() {
    let script = "
        0 join 1 1
        0 frame 1 10x30
        1 request-drain 1
        1 request-drain 1
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
        > 1 request-drain 1
        1: drain
        > 1 request-drain 1
        > 1 resume 1
        > 2 done 1 1.0
        > 3 done 1 1.1
        1: disconnect (reconnect never), it drains and holds no more leases",
    );
}

#[test]
fn a_paused_worker_gets_no_leases_and_its_segments_get_backup_tasks() {
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
