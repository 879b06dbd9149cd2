//! Scripts and transcripts: what is told to the scheduler (`>`), and exactly what it answers.
//!
//! A line of a script is `MILLISECONDS COMMAND`: `frame N WxH`, `join W THREADS [HOST]` (without it, a host of its own), `leave W`, `drain W`,
//! `retire W` (the user wants it to drain), `pause W`, `resume W`, `done W FRAME.SEGMENT`, `fail W FRAME`, `pong W NONCE`, `wake`,
//! `verified W FRAME.SEGMENT same|different`, `judged FRAME.SEGMENT right|wrong right|wrong` (painter, checker),
//! `reject FRAME FIRST+ROWS`. After the policy, `, verify PERCENT SEED` may stand.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

use super::{Action, Cost, Event, Finding, FrameId, HostId, Lease, Return, Scheduler, Verdict, WorkerId};

/// Runs a script and writes the transcript.
pub(super) fn transcript(policy: &str, script: &str) -> String {
    let (policy, verify) = policy.split_once(", verify ").unwrap_or((policy, "0 0"));
    let (percent, seed) = verify.split_once(' ').unwrap();
    let scheduler = Scheduler::new(policy.parse().unwrap(), 1 << 20);
    let mut scheduler = scheduler.with_verification(percent.parse().unwrap(), [seed.parse().unwrap(); 32]);
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
            writeln!(log, "{}", spoken(&action)).unwrap();
        }
    }
    log
}

fn event(command: &str, granted: &BTreeMap<(WorkerId, FrameId, u32), Lease>) -> Event {
    let words: Vec<&str> = command.split(' ').collect();
    let number = |word: &str| word.parse::<u64>().unwrap();
    let pair = |word: &str, by| word.split_once(by).map(|(a, b)| (number(a), number(b) as u32)).unwrap();
    let worker = WorkerId(words.get(1).and_then(|word| word.parse().ok()).unwrap_or(0));
    match words[..] {
        ["frame", frame, size] => {
            let (width, height) = pair(size, 'x');
            Event::FrameRequested { frame: FrameId(number(frame)), width: width as u32, height, tile_rows: 8 }
        }
        ["give-up", next] => Event::RequestsGivenUp { next: FrameId(number(next)) },
        ["join", _, threads] => {
            let host = HostId(1000 + u128::from(worker.0));
            Event::WorkerJoined { worker, threads: number(threads) as u32, host }
        }
        ["join", _, threads, host] => {
            let host = HostId(number(host).into());
            Event::WorkerJoined { worker, threads: number(threads) as u32, host }
        }
        ["leave", _] => Event::WorkerLeft { worker },
        ["drain", _] => Event::WorkerDrains { worker },
        ["retire", _] => Event::DrainRequested { worker },
        ["pause", _] => Event::PauseRequested { worker },
        ["resume", _] => Event::ResumeRequested { worker },
        ["done", _, segment] => {
            let (frame, segment) = pair(segment, '.');
            let lease = granted[&(worker, FrameId(frame), segment)];
            Event::SegmentDone { worker, lease, cost: Cost { primary: 1, ..Cost::default() } }
        }
        ["verified", _, segment, finding] => {
            let (frame, segment) = pair(segment, '.');
            let lease = granted[&(worker, FrameId(frame), segment)];
            let finding = if finding == "same" { Finding::Same } else { Finding::Different };
            Event::SegmentVerified { worker, lease, cost: Cost::default(), finding }
        }
        ["judged", segment, painter, checker] => {
            let (frame, segment) = pair(segment, '.');
            let verdict = Verdict { traced: true, painter: painter == "wrong", checker: checker == "wrong" };
            Event::SegmentJudged { frame: FrameId(frame), segment, verdict }
        }
        ["reject", frame, rows] => {
            let (first_row, row_count) = pair(rows, '+');
            Event::RowsRejected { frame: FrameId(number(frame)), first_row: first_row as u32, row_count }
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
        Action::FrameFailed { frame } => format!("give up {}", frame.0),
        Action::Announce { worker, frame } => format!("{}: frame {}", worker.0, frame.0),
        Action::Grant { worker, lease } => {
            let Lease { frame, segment, attempt, first_row, row_count } = lease;
            let again = if *attempt > 0 { format!(" (attempt {attempt})") } else { String::new() };
            format!("{}: render {}.{segment}{again}, rows {first_row}+{row_count}", worker.0, frame.0)
        }
        Action::Seal { worker, lease } => {
            let Lease { frame, segment, first_row, row_count, .. } = lease;
            format!("seal {}.{segment}, rows {first_row}+{row_count} of {}", frame.0, worker.0)
        }
        Action::Verify { worker, lease } => {
            let Lease { frame, segment, first_row, row_count, .. } = lease;
            format!("{}: verify {}.{segment}, rows {first_row}+{row_count}", worker.0, frame.0)
        }
        Action::Judge { frame, segment } => format!("judge {}.{segment}", frame.0),
        Action::Unseal { frame, segment } => format!("unseal {}.{segment}", frame.0),
        Action::Expel { worker, reason } => format!("{}: expelled, {reason}", worker.0),
        Action::Cancel { worker, before } => format!("{}: cancel before {}", worker.0, before.0),
        Action::Ping { worker, nonce } => format!("{}: ping {nonce}", worker.0),
        Action::Dismiss { worker, reason, again: Return::Welcome } => {
            format!("{}: goodbye, {reason}", worker.0)
        }
        Action::Dismiss { worker, reason, again: Return::NextMaster } => {
            format!("{}: goodbye until the next master, {reason}", worker.0)
        }
        Action::Dismiss { worker, reason, again: Return::Unwanted } => {
            format!("{}: goodbye for good, {reason}", worker.0)
        }
        Action::Drain { worker } => format!("{}: drain", worker.0),
    }
}

/// Compares without regard to indentation.
#[track_caller]
pub(super) fn expect(policy: &str, script: &str, expected: &str) {
    let expected: String = expected.trim().lines().map(|line| format!("{}\n", line.trim())).collect();
    let actual = transcript(policy, script);
    assert_eq!(actual, expected, "\nthe transcript was:\n{actual}");
}
