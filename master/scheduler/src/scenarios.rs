//! Scenarios, action by action. `transcript` describes the scripts, `transcript::recorded` the files of the folder `transcripts`.

use super::transcript::{check, folder, transcript};

/// Defines a test for each recorded transcript, and the list of their names.
macro_rules! recorded {
    ($($name:ident,)*) => {
        /// Names of the scenarios with a recorded transcript.
        const RECORDED: &[&str] = &[$(stringify!($name)),*];
        $(
            #[test]
            fn $name() {
                check(
                    stringify!($name),
                    include_str!(concat!("../transcripts/", stringify!($name), ".txt")),
                );
            }
        )*
    };
}

recorded! {
    // Policies.
    static_segments_go_out_in_order_two_to_each_worker,
    smart_halves_the_last_segments,
    under_adaptive_idle_workers_begin_the_next_frame,
    // Workers that leave, fail or are silent.
    rows_of_a_lost_worker_are_requeued_at_the_front,
    a_new_worker_finishes_the_frame_of_the_last_one,
    a_failing_worker_backs_off_and_gets_the_frame_announced_again,
    a_suspect_worker_gets_no_leases_until_it_is_heard,
    // Requests.
    the_latest_request_replaces_the_waiting_one,
    leases_of_dropped_requests_are_cancelled_at_once,
    // Paused and draining workers.
    a_draining_worker_finishes_its_leases,
    a_drain_request_notifies_the_worker_and_ends_with_its_leases,
    a_paused_worker_gets_no_leases_and_its_segments_get_backup_tasks,
    // Verification.
    second_renderings_go_to_other_workers_and_pictures_do_not_wait,
    a_worker_with_wrong_pixels_is_banned_and_its_rows_in_flight_are_requeued,
    verifications_of_a_lost_worker_go_to_another,
    a_lone_worker_is_verified_by_the_master,
    verifications_for_the_master_do_not_expire,
    unfinished_verifications_are_dropped_two_frames_later,
    a_worker_of_another_host_renders_second,
    failed_verifications_go_to_the_master,
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
    let end: Vec<_> = log.split("> 10000 wake\n").nth(1).unwrap().lines().collect();
    assert!(end[0].starts_with("1: disconnect (reconnect now), "), "{log}");
    assert_eq!(end[1..], ["2: ping 8", "2: render 1.0 (attempt 1), rows 0+10"], "{log}");
}

#[test]
fn no_worker_is_disconnected_for_a_pause_of_the_master() {
    let log = transcript("static:10", "0 join 1 1\n0 frame 1 10x10\n60000 wake\n60100 done 1 1.0");
    assert!(!log.contains("disconnect") && log.contains("finished 1"), "{log}");
}

#[test]
fn every_recorded_transcript_has_a_scenario() {
    let files = std::fs::read_dir(folder()).unwrap();
    let mut files: Vec<_> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    let mut scenarios: Vec<_> = RECORDED.iter().map(|name| format!("{name}.txt")).collect();
    files.sort();
    scenarios.sort();
    assert_eq!(files, scenarios);
}
