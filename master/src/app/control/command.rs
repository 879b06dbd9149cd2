//! Commands and their syntax.

use rayfarm_text::printable;
use rayfarm_tracer::scene::knobs::KNOBS;

use crate::app::knob_values;
use crate::viewer::KnobChange;
use crate::viewer::edits::EditCommand;

/// A command of one line.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Command {
    /// Lists the workers.
    Workers,
    /// Reports the progress of the run.
    Status,
    /// Lists the commands.
    Help,
    /// Ends the run, as Ctrl-C does.
    Quit,
    /// Disconnects a worker after it has finished its leases.
    Drain(WorkerSelector),
    /// Disconnects a worker at once and refuses it from then on.
    Kick(WorkerSelector),
    /// Grants a worker no more leases.
    Pause(WorkerSelector),
    /// Grants a worker leases again.
    Resume(WorkerSelector),
    /// Admits a kicked worker again, by number or by name.
    Allow(String),
    /// Gives a knob of the view another value.
    Set(KnobChange),
    /// Shows pictures of paths at rest with or without most of their noise.
    Denoise(bool),
    /// Edits the scene. The line names the change when it is undone.
    Edit(EditCommand, String),
}

/// Workers that a command applies to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum WorkerSelector {
    /// All connected workers.
    All,
    /// One worker, by number or by name.
    One(String),
}

/// Name of the denoiser in `set`.
const DENOISE: &str = "denoise";

/// Syntax and effect of each command.
pub(super) const COMMANDS: [(&str, &str); 29] = [
    ("workers", "list the connected workers"),
    ("status", "report the progress of the run"),
    ("drain ID|NAME", "disconnect a worker after it has finished its leases"),
    ("kick ID|NAME", "disconnect a worker at once and refuse it from then on"),
    ("allow ID|NAME", "admit a kicked worker again"),
    ("pause [ID|NAME]", "grant a worker, or all, no more leases"),
    ("resume [ID|NAME]", "grant a paused worker, or all, leases again"),
    ("set KNOB VALUE", "give a knob of the view another value"),
    ("set denoise on|off", "filter the noise of paths in the picture at rest"),
    ("object list", "list the objects of the scene with their names and items"),
    (
        "object add KIND KEY = VALUE, ...",
        "add a model, sphere, triangle, rectangle, box, disk, plane or group",
    ),
    ("object move NAME X Y Z", "move an object by a vector"),
    ("object rotate NAME X Y Z", "turn an object by degrees about x, y and z"),
    ("object scale NAME FACTOR|X Y Z", "scale an object by one factor or three"),
    ("object set NAME KEY VALUE", "give a key of an object another value"),
    ("object remove NAME", "remove an object"),
    ("material NAME KEY VALUE", "give a key of a material another value"),
    ("light N KEY VALUE", "give a key of a light another value"),
    ("light add KEY = VALUE, ...", "add a light"),
    ("light remove N", "remove a light"),
    ("background KEY VALUE", "give a key of the background another value"),
    ("background { KEY = VALUE, ... }", "replace all keys of the background"),
    ("render KEY VALUE", "give a key of [render] another value"),
    ("ambient VALUE", "give the ambient light another value"),
    ("undo", "undo the last change of the scene"),
    ("redo", "repeat the change that was undone last"),
    ("save FILE", "write the scene to a file"),
    ("help", "print this list"),
    ("quit", "end the run"),
];

impl Command {
    /// Parses a line. A name may contain spaces.
    ///
    /// # Errors
    /// The mistake in the line, and the expected syntax.
    pub(super) fn parse(line: &str) -> Result<Self, String> {
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if let Some(edit) = EditCommand::parse(word, rest) {
            return edit.map(|edit| Self::Edit(edit, line.to_owned()));
        }
        let command = match word {
            "workers" => Self::Workers,
            "status" => Self::Status,
            "help" => Self::Help,
            "quit" => Self::Quit,
            "drain" => return Ok(Self::Drain(one(word, rest)?)),
            "kick" => return Ok(Self::Kick(one(word, rest)?)),
            "allow" => return kicked(word, rest).map(Self::Allow),
            "set" => return setting(rest),
            "pause" => return Ok(Self::Pause(one_or_all(rest))),
            "resume" => return Ok(Self::Resume(one_or_all(rest))),
            "" => return Err("an empty line; help lists the commands".to_owned()),
            other => {
                let other = printable(other);
                return Err(format!("there is no command \"{other}\"; help lists the commands"));
            }
        };
        if rest.is_empty() {
            Ok(command)
        } else {
            Err(format!("{word} takes no argument, but \"{}\" follows it", printable(rest)))
        }
    }
}

/// Parses `KNOB VALUE`, or the switch of the denoiser, which is no knob: workers render the same pixels with it.
fn setting(text: &str) -> Result<Command, String> {
    let (name, value) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    match (name, value.trim()) {
        (DENOISE, "on") => Ok(Command::Denoise(true)),
        (DENOISE, "off") => Ok(Command::Denoise(false)),
        (DENOISE, _) => Err(format!("set {DENOISE}: expected on or off")),
        (name, value) => knob_change(name, value).map(Command::Set),
    }
}

/// Parses a change of a knob, which is named by its option, or by its name in reports.
fn knob_change(name: &str, value: &str) -> Result<KnobChange, String> {
    let Some(knob) = KNOBS.iter().find(|knob| knob.option == name || knob.name == name) else {
        let knobs: Vec<_> = KNOBS.iter().map(|knob| knob.option).collect();
        return Err(format!(
            "set: there is no knob \"{}\"; expected one of {}, {DENOISE}",
            printable(name),
            knobs.join(", ")
        ));
    };
    let value = knob_values::parse(knob, value);
    let value = value.map_err(|expected| format!("set {}: {expected}", knob.option))?;
    Ok(KnobChange { knob, value })
}

fn kicked(word: &str, rest: &str) -> Result<String, String> {
    match rest {
        "" => Err(format!(
            "{word} needs an argument: the number or name of a worker; status lists the kicked ones"
        )),
        worker => Ok(worker.to_owned()),
    }
}

fn one(word: &str, rest: &str) -> Result<WorkerSelector, String> {
    match rest {
        "" => Err(format!("{word} needs an argument: the number or name of a worker; workers lists them")),
        worker => Ok(WorkerSelector::One(worker.to_owned())),
    }
}

fn one_or_all(rest: &str) -> WorkerSelector {
    if rest.is_empty() { WorkerSelector::All } else { WorkerSelector::One(rest.to_owned()) }
}
