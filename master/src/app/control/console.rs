//! Commands performed, and their answers.

use std::borrow::Cow;

use rayfarm_text::printable;
use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

use super::command::{COMMANDS, Command, Whom};
use super::lines::{Line, MAX_LINE_BYTES, is_foreign};
use crate::farm::{FarmControl, FarmStatus, KickedWorker, TransferStatus, UnknownWorker, WorkerStatus};
use crate::viewer::KICK_REASON;

/// Somebody who may give commands.
#[derive(Clone)]
pub(crate) struct Console {
    farm: FarmControl,
    quit: CancellationToken,
}

/// An answer, and what follows from it.
#[derive(Debug, PartialEq)]
pub(super) struct Answer {
    /// One line of JSON with its end.
    pub(super) line: String,
    pub(super) then: Then,
}

/// What to do once the answer is on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Then {
    /// Listen on.
    Listen,
    /// Listen no more to whoever said that.
    Close,
    /// End the run.
    Quit,
}

impl Console {
    /// Commands go to `farm`; `quit` is cancelled where the run shall end.
    pub(crate) fn new(farm: FarmControl, quit: CancellationToken) -> Self {
        Self { farm, quit }
    }

    /// Does what a line asks for.
    pub(super) fn answer(&self, line: &Line) -> Answer {
        let text = match line {
            Line::Text(text) => text,
            Line::TooLong => {
                return refused(&format!("a line has {MAX_LINE_BYTES} bytes at most"), Then::Close);
            }
            Line::Binary => return refused("commands are text", Then::Close),
        };
        if is_foreign(text) {
            return refused("this is no web server; commands are words, such as help", Then::Close);
        }
        match Command::parse(text).and_then(|command| self.perform(&command)) {
            Ok((value, then)) => Answer { line: format!("{value}\n"), then },
            Err(error) => refused(&error, Then::Listen),
        }
    }

    /// Ends the run.
    pub(super) fn quit(&self) {
        self.quit.cancel();
    }

    fn perform(&self, command: &Command) -> Result<(Value, Then), String> {
        let status = self.farm.status();
        let value = match command {
            Command::Workers => json!({ "ok": true, "workers": workers(&status) }),
            Command::Status => progress(&status),
            Command::Help => help(),
            Command::Quit => return Ok((json!({ "ok": true }), Then::Quit)),
            Command::Drain(whom) => self.to_each(&status, whom, FarmControl::drain)?,
            Command::Pause(whom) => self.to_each(&status, whom, FarmControl::pause)?,
            Command::Resume(whom) => self.to_each(&status, whom, FarmControl::resume)?,
            Command::Kick(whom) => self.to_each(&status, whom, |farm, id| farm.kick(id, KICK_REASON))?,
            Command::Allow(whom) => {
                let worker = find_kicked(&status, whom)?;
                json!({ "ok": true, "allowed": usize::from(self.farm.allow_worker(worker)) })
            }
        };
        Ok((value, Then::Listen))
    }

    fn to_each(
        &self,
        status: &FarmStatus,
        whom: &Whom,
        act: impl Fn(&FarmControl, u64) -> Result<(), UnknownWorker>,
    ) -> Result<Value, String> {
        let ids = match whom {
            Whom::All => status.workers.iter().map(|worker| worker.id).collect(),
            Whom::One(whom) => vec![find(status, whom)?],
        };
        // One of many may have left meanwhile; the one that was named must be there.
        let done: Vec<u64> = ids.iter().copied().filter(|&id| act(&self.farm, id).is_ok()).collect();
        match (whom, done.is_empty()) {
            (Whom::One(whom), true) => Err(format!("worker {} has just left", printable(whom))),
            _ => Ok(json!({ "ok": true, "workers": done })),
        }
    }
}

/// The one connected worker of that number, or else of that name.
fn find(status: &FarmStatus, whom: &str) -> Result<u64, String> {
    let known = status.workers.iter().map(|worker| (worker.id, worker.name.as_str()));
    let none = |whom: Cow<str>| format!("no worker \"{whom}\" is connected; workers lists those that are");
    one_of(known, whom, none)
}

/// The one kicked worker of that number, or else of that name.
fn find_kicked(status: &FarmStatus, whom: &str) -> Result<u64, String> {
    let known = status.kicked.iter().map(|worker| (worker.id, worker.name.as_str()));
    let none = |whom: Cow<str>| format!("no worker \"{whom}\" was kicked; status lists those that were");
    one_of(known, whom, none)
}

fn one_of<'a>(
    known: impl Iterator<Item = (u64, &'a str)> + Clone,
    whom: &str,
    none: impl Fn(Cow<str>) -> String,
) -> Result<u64, String> {
    if let Some((id, _)) = known.clone().find(|(id, _)| whom.parse() == Ok(*id)) {
        return Ok(id);
    }
    let named: Vec<u64> = known.filter(|(_, name)| *name == whom).map(|(id, _)| id).collect();
    let shown = printable(whom);
    match *named {
        [id] => Ok(id),
        [] => Err(none(shown)),
        [first, ..] => Err(format!(
            "{} workers are called \"{shown}\"; name one by its number, such as {first}",
            named.len()
        )),
    }
}

fn workers(status: &FarmStatus) -> Vec<Value> {
    let one = |worker: &WorkerStatus| {
        json!({
            "id": worker.id,
            "name": worker.name,
            "local": worker.local,
            "address": worker.address.to_string(),
            "threads": worker.threads,
            "state": worker.state.to_string(),
            "segments_done": worker.segments_done,
            "rows_per_second": (worker.speed * 10.0).round() / 10.0,
            "trouble": worker.trouble,
        })
    };
    status.workers.iter().map(one).collect()
}

fn progress(status: &FarmStatus) -> Value {
    let threads: u32 = status.workers.iter().map(|worker| worker.threads).fold(0, u32::saturating_add);
    let (totals, transfers) =
        (&status.totals, Some(status.transfers).filter(|transfers| transfers.workers > 0));
    json!({
        "ok": true,
        "frame": status.frame.map(|frame| frame.0),
        "rows_done": status.rows_done,
        "rows": status.rows,
        "workers": status.workers.len(),
        "threads": threads,
        "kicked": status.kicked.iter().map(|kicked| &kicked.name).collect::<Vec<_>>(),
        "kicked_workers": status.kicked.iter().map(kicked).collect::<Vec<_>>(),
        "local_gone": status.local_gone,
        "frames_done": totals.frames_done,
        "frames": totals.frames,
        "fps": rounded(totals.fps),
        "elapsed_seconds": rounded(totals.elapsed.as_secs_f64()),
        "seconds_left": totals.left.map(|left| rounded(left.as_secs_f64())),
        "sent_bytes": totals.sent_bytes,
        "received_bytes": totals.received_bytes,
        "scene_bytes": totals.scene_bytes,
        "scene_transfer": transfers.map(|TransferStatus { workers, done, total }| {
            json!({ "workers": workers, "done_bytes": done, "bytes": total })
        }),
    })
}

fn kicked(worker: &KickedWorker) -> Value {
    json!({ "id": worker.id, "name": worker.name, "address": worker.address.map(|address| address.to_string()) })
}

/// Three digits behind the point: what clocks can tell.
fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

fn help() -> Value {
    let lines: Vec<String> = COMMANDS.iter().map(|(command, what)| format!("{command}: {what}")).collect();
    json!({ "ok": true, "commands": lines })
}

pub(super) fn refused(error: &str, then: Then) -> Answer {
    Answer { line: format!("{}\n", json!({ "ok": false, "error": error })), then }
}
