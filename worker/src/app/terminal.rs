//! Questions on the terminal.

use std::io::{self, IsTerminal, Write};

use super::trust::read_line;

/// Prints a question to standard error and reads a line from the terminal, which is not displayed where the system allows
/// that. Returns `None` where standard input is no terminal.
///
/// # Errors
/// A line that is too long, and errors of the terminal.
pub(super) fn ask_secret(question: &str) -> io::Result<Option<String>> {
    let stdin = io::stdin();
    if !stdin.is_terminal() {
        return Ok(None);
    }
    eprint!("{question}");
    io::stderr().flush()?;
    let hidden = HiddenInput::begin();
    let line = read_line(stdin.lock());
    if hidden.is_some() {
        eprintln!();
    }
    line.map(Some)
}

/// Standard input without the display of typed characters, which returns when this value is dropped.
#[cfg(unix)]
struct HiddenInput {
    before: rustix::termios::Termios,
}

#[cfg(unix)]
impl HiddenInput {
    fn begin() -> Option<Self> {
        use rustix::termios::{LocalModes, OptionalActions, tcgetattr, tcsetattr};
        let before = tcgetattr(io::stdin()).ok()?;
        let mut hidden = before.clone();
        hidden.local_modes.remove(LocalModes::ECHO);
        tcsetattr(io::stdin(), OptionalActions::Flush, &hidden).ok()?;
        Some(Self { before })
    }
}

#[cfg(unix)]
impl Drop for HiddenInput {
    fn drop(&mut self) {
        let _ =
            rustix::termios::tcsetattr(io::stdin(), rustix::termios::OptionalActions::Flush, &self.before);
    }
}

/// Input cannot be hidden on this system.
#[cfg(not(unix))]
struct HiddenInput;

#[cfg(not(unix))]
impl HiddenInput {
    fn begin() -> Option<Self> {
        None
    }
}
