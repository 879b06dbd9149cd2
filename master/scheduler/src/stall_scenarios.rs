//! Scenarios of workers that answer pings and finish no lease: slow ones, stuck ones and ones that report too much.

use std::fmt::Write as _;

use super::transcript::transcript;

const FIRST_LEASE: &str = "0 join 1 1\n0 frame 1 10x10\n";

/// Wakes the scheduler every 2 s in these seconds. Worker `worker` answers each ping, with or without progress.
fn pongs(worker: u64, seconds: std::ops::Range<u64>, progress: &str) -> String {
    let mut script = String::new();
    for (nonce, second) in seconds.step_by(2).enumerate() {
        writeln!(script, "{second}000 wake\n{second}001 pong {worker} {nonce}{progress}").unwrap();
    }
    script
}

/// The second of the first disconnect of a transcript, and its reason.
fn disconnected(log: &str) -> Option<(u64, &str)> {
    let (before, after) = log.split_once(": disconnect (reconnect now), ")?;
    let event = before.lines().rev().find(|line| line.starts_with('>'))?;
    let at_ms: u64 = event.split(' ').nth(1)?.parse().ok()?;
    Some((at_ms / 1000, after.lines().next()?))
}

#[test]
fn a_slow_worker_with_progress_stays_connected() {
    let script = format!("{FIRST_LEASE}{}700500 done 1 1.0", pongs(1, 2..701, " progress"));
    let log = transcript("static:10", &script);
    assert!(disconnected(&log).is_none() && log.contains("finished 1 after 700500 ms"), "{log}");
}

#[test]
fn a_worker_without_progress_is_disconnected() {
    let log = transcript("static:10", &format!("{FIRST_LEASE}{}", pongs(1, 2..100, "")));
    let reason = "it holds leases and has made no progress for 60 s";
    assert_eq!(disconnected(&log), Some((60, reason)), "{log}");
}

#[test]
fn a_worker_that_stops_making_progress_within_a_lease_is_disconnected() {
    let script = format!("{FIRST_LEASE}{}{}", pongs(1, 2..201, " progress"), pongs(1, 202..400, ""));
    let log = transcript("static:10", &script);
    let reason = "it holds leases and has made no progress for 60 s";
    // Its last report of progress is of second 200.001.
    assert_eq!(disconnected(&log), Some((262, reason)), "{log}");
}

#[test]
fn progress_without_a_finished_lease_has_a_limit() {
    // Ten rows are two tile bands of eight rows, with an hour each.
    let script =
        format!("{FIRST_LEASE}{}7300000 join 2 1\n7300001 done 2 1.0", pongs(1, 2..7300, " progress"));
    let log = transcript("static:10", &script);
    let reason = "it holds leases and has finished none for 7200 s";
    assert_eq!(disconnected(&log), Some((7200, reason)));
    assert!(log.ends_with("finished 1 after 7300001 ms, 1 rays\n"), "{}", &log[log.len() - 400..]);
}

#[test]
fn a_finished_lease_resets_the_limit() {
    let script = format!(
        "0 join 1 1\n0 frame 1 10x20\n{}4000500 done 1 1.0\n{}",
        pongs(1, 2..4001, " progress"),
        pongs(1, 4002..11200, " progress")
    );
    // Four bands of two leases have a limit of 14,400 s; the two that are left have one of 7200 s.
    assert_eq!(disconnected(&transcript("static:10", &script)), None);
    let log = transcript("static:10", &format!("{script}{}", pongs(1, 11200..11206, " progress")));
    assert_eq!(disconnected(&log).map(|(at, _)| at), Some(11_202));
}

#[test]
fn the_timeout_doubles_with_each_stalled_worker() {
    let script = format!("{FIRST_LEASE}{}61000 join 2 1\n{}", pongs(1, 2..61, ""), pongs(2, 62..300, ""));
    let log = transcript("static:10", &script);
    let reason = "it holds leases and has made no progress for 120 s";
    assert_eq!(disconnected(log.split_once("> 61000 join").unwrap().1), Some((182, reason)), "{log}");
}

#[test]
fn progress_without_leases_changes_nothing() {
    let log = transcript(
        "static:10",
        &format!("0 join 1 1\n{}100000 frame 1 10x10", pongs(1, 2..100, " progress")),
    );
    assert_eq!(disconnected(&log), None, "{log}");
}

/// A script in which a part of a message of worker 1 arrives every 10 s, until second `until`, and the whole message in
/// second 139.
fn arriving(until: u64) -> String {
    let mut script = FIRST_LEASE.to_owned();
    for second in (2..139).step_by(2) {
        if second % 10 == 0 && second <= until {
            writeln!(script, "{second}000 receiving 1").unwrap();
        }
        writeln!(script, "{second}000 wake").unwrap();
    }
    script + "139000 done 1 1.0"
}

#[test]
fn a_worker_whose_message_arrives_slowly_is_not_silent() {
    let log = transcript("static:10", &arriving(110));
    assert_eq!(disconnected(&log), Some((120, "it has been silent for 10 s")), "{log}");
    let log = transcript("static:10", &arriving(130));
    assert!(disconnected(&log).is_none() && log.contains("finished 1 after 139000 ms"), "{log}");
}
