//! What a line asks for.

use rayfarm_text::printable;

/// A command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Command {
    /// List the workers.
    Workers,
    /// How far the run is.
    Status,
    /// What can be said.
    Help,
    /// End the run, as Ctrl-C does.
    Quit,
    /// Let a worker finish what it holds and leave.
    Drain(Whom),
    /// Send a worker away at once and keep it out.
    Kick(Whom),
    /// Give a worker no more leases.
    Pause(Whom),
    /// Give it leases again.
    Resume(Whom),
    /// Let a kicked worker come back, by number or by name.
    Allow(String),
}

/// Which worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Whom {
    /// Every one that is connected.
    All,
    /// By number or by name.
    One(String),
}

/// What can be said, and what it does.
pub(super) const COMMANDS: [(&str, &str); 9] = [
    ("workers", "the connected workers"),
    ("status", "how far the run is"),
    ("drain ID|NAME", "a worker finishes what it holds and leaves"),
    ("kick ID|NAME", "a worker is sent away at once and kept out"),
    ("allow ID|NAME", "a kicked worker may come back"),
    ("pause [ID|NAME]", "a worker, or all, get no more work"),
    ("resume [ID|NAME]", "a paused worker, or all, get work again"),
    ("help", "this list"),
    ("quit", "end the run"),
];

impl Command {
    /// Reads a line. A name may have spaces in it.
    ///
    /// # Errors
    /// What is wrong with it and what was expected.
    pub(super) fn parse(line: &str) -> Result<Self, String> {
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let command = match word {
            "workers" => Self::Workers,
            "status" => Self::Status,
            "help" => Self::Help,
            "quit" => Self::Quit,
            "drain" => return Ok(Self::Drain(one(word, rest)?)),
            "kick" => return Ok(Self::Kick(one(word, rest)?)),
            "allow" => return kicked(word, rest).map(Self::Allow),
            "pause" => return Ok(Self::Pause(one_or_all(rest))),
            "resume" => return Ok(Self::Resume(one_or_all(rest))),
            "" => return Err("an empty line; help lists the commands".to_owned()),
            other => {
                let other = printable(other);
                return Err(format!("there is no command \"{other}\"; help lists those there are"));
            }
        };
        if rest.is_empty() {
            Ok(command)
        } else {
            Err(format!("{word} stands alone, without \"{}\"", printable(rest)))
        }
    }
}

fn kicked(word: &str, rest: &str) -> Result<String, String> {
    match rest {
        "" => Err(format!(
            "{word} whom? expected a worker's number or name after it; status lists those kicked"
        )),
        whom => Ok(whom.to_owned()),
    }
}

fn one(word: &str, rest: &str) -> Result<Whom, String> {
    match rest {
        "" => Err(format!("{word} whom? expected a worker's number or name after it; workers lists them")),
        whom => Ok(Whom::One(whom.to_owned())),
    }
}

fn one_or_all(rest: &str) -> Whom {
    if rest.is_empty() { Whom::All } else { Whom::One(rest.to_owned()) }
}
