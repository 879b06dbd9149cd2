//! Commands performed, and their answers.

use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

use super::command::{COMMANDS, Command, Whom};
use super::lines::{Line, MAX_LINE_BYTES};
use crate::farm::{FarmControl, FarmStatus, UnknownWorker, WorkerStatus};

/// What a kicked worker is told.
pub(crate) const KICKED: &str = "it was kicked by the master's user";

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
                return refused(&format!("a line has {MAX_LINE_BYTES} bytes at most"), Then::Listen);
            }
        };
        // A web page can make its visitor's browser talk to this machine's ports: what it says after its first line,
        // it shall say to nobody.
        if text.contains("HTTP/1") {
            return refused("this is no web server", Then::Close);
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
            Command::Kick(whom) => self.to_each(&status, whom, |farm, id| farm.kick(id, KICKED))?,
            Command::Allow(name) => match self.farm.allow(name) {
                0 => {
                    return Err(format!(
                        "no worker called {name:?} was kicked; status lists those that were"
                    ));
                }
                allowed => json!({ "ok": true, "allowed": allowed }),
            },
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
            (Whom::One(whom), true) => Err(format!("worker {whom} has just left")),
            _ => Ok(json!({ "ok": true, "workers": done })),
        }
    }
}

/// The one worker of that number, or else of that name.
fn find(status: &FarmStatus, whom: &str) -> Result<u64, String> {
    let by_number = |worker: &&WorkerStatus| whom.parse() == Ok(worker.id);
    if let Some(worker) = status.workers.iter().find(by_number) {
        return Ok(worker.id);
    }
    let named: Vec<u64> =
        status.workers.iter().filter(|worker| worker.name == whom).map(|worker| worker.id).collect();
    match *named {
        [id] => Ok(id),
        [] => Err(format!("no worker {whom:?} is connected; workers lists those that are")),
        [first, ..] => Err(format!(
            "{} workers are called {whom:?}; name one by its number, such as {first}",
            named.len()
        )),
    }
}

fn workers(status: &FarmStatus) -> Vec<Value> {
    let one = |worker: &WorkerStatus| {
        json!({
            "id": worker.id,
            "name": worker.name,
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
    json!({
        "ok": true,
        "frame": status.frame.map(|frame| frame.0),
        "rows_done": status.rows_done,
        "rows": status.rows,
        "workers": status.workers.len(),
        "threads": threads,
        "kicked": status.kicked,
    })
}

fn help() -> Value {
    let lines: Vec<String> = COMMANDS.iter().map(|(command, what)| format!("{command}: {what}")).collect();
    json!({ "ok": true, "commands": lines })
}

fn refused(error: &str, then: Then) -> Answer {
    Answer { line: format!("{}\n", json!({ "ok": false, "error": error })), then }
}
