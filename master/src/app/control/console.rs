//! Execution of commands, and their answers.

use std::borrow::Cow;

use rayfarm_farm::{FarmControl, FarmStatus, TransferStatus, UnknownWorker};
use rayfarm_text::printable;
use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

use super::command::{COMMANDS, Command, WorkerSelector};
#[cfg(feature = "web")]
use super::lines::LineSplitter;
use super::lines::{Line, MAX_LINE_BYTES, is_foreign};
use crate::viewer::edits::EditorHandle;
use crate::viewer::{KICK_REASON, KnobSender, banned_facts, worker_facts};

/// Executor of the commands of one or more connections.
#[derive(Clone)]
pub(crate) struct Console {
    farm: FarmControl,
    /// `None` in a run without a view.
    view: Option<KnobSender>,
    /// `None` in a run without a view, or where the scene cannot be edited.
    editor: Option<EditorHandle>,
    quit: CancellationToken,
}

/// An answer, and the action that follows it.
#[derive(Debug, PartialEq)]
pub(super) struct Answer {
    /// One line of JSON, with its newline.
    pub(super) line: String,
    pub(super) then: Then,
}

/// Action after an answer has been written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Then {
    /// Reads the next command.
    Listen,
    /// Closes the connection.
    Close,
    /// Ends the run.
    Quit,
}

impl Console {
    /// An executor for `farm` and the knobs of `view`. Cancels `quit` at the command of that name.
    pub(crate) fn new(farm: FarmControl, view: Option<KnobSender>, quit: CancellationToken) -> Self {
        Self { farm, view, editor: None, quit }
    }

    /// The executor with an editor of the scene.
    pub(crate) fn with_editor(self, editor: Option<EditorHandle>) -> Self {
        Self { editor, ..self }
    }

    /// Executes a line. Waits while a changed scene is loaded.
    pub(super) fn answer(&self, line: &Line) -> Answer {
        let text = match line {
            Line::Text(text) => text,
            Line::TooLong => {
                return refused(&format!("a line must not exceed {MAX_LINE_BYTES} bytes"), Then::Close);
            }
            Line::Binary => return refused("commands are text", Then::Close),
        };
        if is_foreign(text) {
            return refused("this is not a web server; commands are words, such as help", Then::Close);
        }
        match Command::parse(text).and_then(|command| self.perform(&command)) {
            Ok((value, then)) => Answer { line: format!("{value}\n"), then },
            Err(error) => refused(&error, Then::Listen),
        }
    }

    /// Executes a text of one line and returns its answer. Ends the run at the command `quit`.
    #[cfg(feature = "web")]
    pub(crate) fn execute(&self, text: &str) -> String {
        let mut splitter = LineSplitter::default();
        let line = text.bytes().find_map(|byte| splitter.push(byte)).or_else(|| splitter.end());
        let answer = self.answer(&line.unwrap_or(Line::Text(String::new())));
        if answer.then == Then::Quit {
            self.quit();
        }
        answer.line
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
            Command::Drain(workers) => self.to_each(&status, workers, FarmControl::drain)?,
            Command::Pause(workers) => self.to_each(&status, workers, FarmControl::pause)?,
            Command::Resume(workers) => self.to_each(&status, workers, FarmControl::resume)?,
            Command::Kick(workers) => self.to_each(&status, workers, |farm, id| farm.ban(id, KICK_REASON))?,
            Command::Set(change) => {
                self.view()?.send(*change)?;
                json!({ "ok": true, "knob": change.knob.name })
            }
            Command::Denoise(on) => {
                self.view()?.denoise(*on)?;
                json!({ "ok": true, "denoise": on })
            }
            Command::Edit(edit, line) => {
                let editor = self.editor.as_ref();
                let editor =
                    editor.ok_or("the scene of this run cannot be edited: that needs a view of a scene")?;
                editor.perform(edit.clone(), line)?
            }
            Command::Allow(worker) => {
                let worker = find_kicked(&status, worker)?;
                json!({ "ok": true, "allowed": usize::from(self.farm.allow_worker(worker)) })
            }
        };
        Ok((value, Then::Listen))
    }

    fn view(&self) -> Result<&KnobSender, String> {
        self.view.as_ref().ok_or_else(|| "set needs a view, and this run writes files".to_owned())
    }

    fn to_each(
        &self,
        status: &FarmStatus,
        selector: &WorkerSelector,
        act: impl Fn(&FarmControl, u64) -> Result<(), UnknownWorker>,
    ) -> Result<Value, String> {
        let ids = match selector {
            WorkerSelector::All => status.workers.iter().map(|worker| worker.id).collect(),
            WorkerSelector::One(worker) => vec![find(status, worker)?],
        };
        // One of many may have disconnected meanwhile; a named one must be connected.
        let done: Vec<u64> = ids.iter().copied().filter(|&id| act(&self.farm, id).is_ok()).collect();
        match (selector, done.is_empty()) {
            (WorkerSelector::One(worker), true) => {
                Err(format!("worker {} has just disconnected", printable(worker)))
            }
            _ => Ok(json!({ "ok": true, "workers": done })),
        }
    }
}

/// Number of the only connected worker of that number, or else of that name.
fn find(status: &FarmStatus, text: &str) -> Result<u64, String> {
    let known = status.workers.iter().map(|worker| (worker.id, worker.name.as_str()));
    let none =
        |text: Cow<str>| format!("no worker \"{text}\" is connected; workers lists the connected ones");
    one_of(known, text, none)
}

/// Number of the only kicked worker of that number, or else of that name.
fn find_kicked(status: &FarmStatus, text: &str) -> Result<u64, String> {
    let known = status.banned.iter().map(|worker| (worker.id, worker.name.as_str()));
    let none = |text: Cow<str>| format!("no worker \"{text}\" was kicked; status lists the kicked ones");
    one_of(known, text, none)
}

fn one_of<'a>(
    known: impl Iterator<Item = (u64, &'a str)> + Clone,
    text: &str,
    none: impl Fn(Cow<str>) -> String,
) -> Result<u64, String> {
    if let Some((id, _)) = known.clone().find(|(id, _)| text.parse() == Ok(*id)) {
        return Ok(id);
    }
    let named: Vec<u64> = known.filter(|(_, name)| *name == text).map(|(id, _)| id).collect();
    let shown = printable(text);
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
    status.workers.iter().map(worker_facts).collect()
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
        "kicked": status.banned.iter().map(|kicked| &kicked.name).collect::<Vec<_>>(),
        "kicked_workers": status.banned.iter().map(banned_facts).collect::<Vec<_>>(),
        "local_gone": status.local_exited,
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

/// Rounds to three decimals, the precision of the clocks.
fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

fn help() -> Value {
    let lines: Vec<String> = COMMANDS.iter().map(|(command, what)| format!("{command}: {what}")).collect();
    json!({ "ok": true, "commands": lines })
}

/// The answer to a line that is refused.
pub(super) fn refused(error: &str, then: Then) -> Answer {
    Answer { line: format!("{}\n", json!({ "ok": false, "error": error })), then }
}
