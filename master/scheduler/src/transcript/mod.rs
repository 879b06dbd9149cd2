//! Scripts and transcripts: events into the scheduler (`>`) and the exact actions that follow.
//!
//! A line of a script is `MILLISECONDS COMMAND`. Commands, with `W` a worker's number:
//!
//! - `frame N WxH`, `drop-requests NEXT`
//! - `join W THREADS [HOST]` (by default each worker has a host of its own), `join-untrusted W THREADS`, `leave W`
//! - `drain W` (by the worker), `request-drain W` (by the master's user), `pause W`, `resume W`
//! - `done W FRAME.SEGMENT`, `fail W FRAME`, `reject FRAME FIRST+ROWS`
//! - `verified W FRAME.SEGMENT same|different`, `arbitrated FRAME.SEGMENT right|wrong right|wrong` (first, second)
//! - `pong W NONCE`, `pong W NONCE progress` (its threads have made progress since its previous pong), `receiving W`, `wake`
//!
//! The policy may be followed by `, verify PERCENT KEY`.
//!
//! `recorded` compares transcripts with files.

mod recorded;

pub(crate) use recorded::{check, folder};

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

use super::{
    Action, ArbiterResult, Cost, Event, Finding, FrameId, HostId, Lease, Reconnect, Scheduler, WorkerId,
};

/// Runs a script and returns the transcript.
pub(super) fn transcript(policy: &str, script: &str) -> String {
    let (policy, verify) = policy.split_once(", verify ").unwrap_or((policy, "0 0"));
    let (percent, key) = verify.split_once(' ').unwrap();
    let scheduler = Scheduler::new(policy.parse().unwrap(), 1 << 20);
    let mut scheduler = scheduler.with_verification(percent.parse().unwrap(), [key.parse().unwrap(); 32]);
    let mut granted = BTreeMap::new();
    let mut log = String::new();
    for line in script.lines().map(str::trim).filter(|line| !line.is_empty()) {
        writeln!(log, "> {line}").unwrap();
        let (at_ms, command) = line.split_once(' ').unwrap();
        let now = Duration::from_millis(at_ms.parse().unwrap());
        scheduler.handle(now, event(command, &granted));
        while let Some(action) = scheduler.poll_action() {
            if let Action::Grant { worker, lease } | Action::Verify { worker, lease } = &action {
                granted.insert((*worker, lease.frame, lease.segment), *lease);
            }
            writeln!(log, "{}", described(&action)).unwrap();
        }
    }
    log
}

fn event(command: &str, granted: &BTreeMap<(WorkerId, FrameId, u32), Lease>) -> Event {
    let words: Vec<&str> = command.split(' ').collect();
    let number = |word: &str| word.parse::<u64>().unwrap();
    let pair = |word: &str, by| word.split_once(by).map(|(a, b)| (number(a), number(b) as u32)).unwrap();
    let worker = WorkerId(words.get(1).and_then(|word| word.parse().ok()).unwrap_or(0));
    let lease = |segment: &str| {
        let (frame, number) = pair(segment, '.');
        let lease = granted.get(&(worker, FrameId(frame), number));
        *lease.unwrap_or_else(|| panic!("{command}: the worker has had no lease {segment}"))
    };
    match words[..] {
        ["frame", frame, size] => {
            let (width, height) = pair(size, 'x');
            let (frame, row_bytes) = (FrameId(number(frame)), 3 * width);
            Event::FrameRequested { frame, width: width as u32, height, row_bytes, tile_rows: 8 }
        }
        ["drop-requests", next] => Event::RequestsDropped { next: FrameId(number(next)) },
        [join @ ("join" | "join-untrusted"), _, threads] => {
            let (host, trusted) = (HostId(1000 + u128::from(worker.0)), join == "join");
            Event::WorkerJoined { worker, threads: number(threads) as u32, host, trusted }
        }
        ["join", _, threads, host] => {
            let host = HostId(number(host).into());
            Event::WorkerJoined { worker, threads: number(threads) as u32, host, trusted: true }
        }
        ["leave", _] => Event::WorkerLeft { worker },
        ["drain", _] => Event::WorkerDrains { worker },
        ["request-drain", _] => Event::DrainRequested { worker },
        ["pause", _] => Event::PauseRequested { worker },
        ["resume", _] => Event::ResumeRequested { worker },
        ["done", _, segment] => {
            let lease = lease(segment);
            Event::SegmentDone { worker, lease, cost: Cost { primary: 1, ..Cost::default() } }
        }
        ["verified", _, segment, finding] => {
            let lease = lease(segment);
            let finding = if finding == "same" { Finding::Same } else { Finding::Different };
            Event::SegmentVerified { worker, lease, cost: Cost::default(), finding }
        }
        ["arbitrated", segment, first, second] => {
            let (frame, segment) = pair(segment, '.');
            let (first_differs, second_differs) = (first == "wrong", second == "wrong");
            let result = ArbiterResult { rendered: true, first_differs, second_differs };
            Event::SegmentArbitrated { frame: FrameId(frame), segment, result }
        }
        ["reject", frame, rows] => {
            let (first_row, row_count) = pair(rows, '+');
            Event::RowsRejected { frame: FrameId(number(frame)), first_row: first_row as u32, row_count }
        }
        ["fail", _, frame] => Event::WorkerFailed { worker, frame: FrameId(number(frame)) },
        ["pong", _, nonce] => Event::Pong { worker, nonce: number(nonce), progressed: false },
        ["pong", _, nonce, "progress"] => Event::Pong { worker, nonce: number(nonce), progressed: true },
        ["receiving", _] => Event::Receiving { worker },
        ["wake"] => Event::Woken,
        _ => panic!("no such command: {command}"),
    }
}

fn described(action: &Action) -> String {
    match action {
        Action::BeginFrame { frame } => format!("begin {}", frame.0),
        Action::FrameDone { frame, cost, elapsed } => {
            format!("finished {} after {} ms, {} rays", frame.0, elapsed.as_millis(), cost.primary)
        }
        Action::FrameDropped { frame } => format!("drop {}", frame.0),
        Action::FrameFailed { frame } => format!("fail {}", frame.0),
        Action::Announce { worker, frame } => format!("{}: frame {}", worker.0, frame.0),
        Action::Grant { worker, lease } => {
            let Lease { frame, segment, attempt, first_row, row_count } = lease;
            let again = if *attempt > 0 { format!(" (attempt {attempt})") } else { String::new() };
            format!("{}: render {}.{segment}{again}, rows {first_row}+{row_count}", worker.0, frame.0)
        }
        Action::RecordDigest { worker, lease } => {
            let Lease { frame, segment, first_row, row_count, .. } = lease;
            format!("record digest {}.{segment}, rows {first_row}+{row_count} of {}", frame.0, worker.0)
        }
        Action::Verify { worker, lease } => {
            let Lease { frame, segment, first_row, row_count, .. } = lease;
            format!("{}: verify {}.{segment}, rows {first_row}+{row_count}", worker.0, frame.0)
        }
        Action::Arbitrate { frame, segment } => format!("arbitrate {}.{segment}", frame.0),
        Action::DropDigest { frame, segment } => format!("drop digest {}.{segment}", frame.0),
        Action::Ban { worker, reason } => format!("{}: ban, {reason}", worker.0),
        Action::Cancel { worker, before } => format!("{}: cancel before {}", worker.0, before.0),
        Action::Ping { worker, nonce } => format!("{}: ping {nonce}", worker.0),
        Action::Disconnect { worker, reason, reconnect } => {
            let reconnect = match reconnect {
                Reconnect::Now => "now",
                Reconnect::NextMaster => "to the next master",
                Reconnect::Never => "never",
            };
            format!("{}: disconnect (reconnect {reconnect}), {reason}", worker.0)
        }
        Action::Drain { worker } => format!("{}: drain", worker.0),
    }
}
