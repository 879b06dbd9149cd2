//! Commands on standard input, answers on standard output.

use std::io::{self, Read, Write};

use super::console::{Console, Then};
use super::lines::{Line, Lines};
use crate::app::error::CommandError;

/// A thread of its own, that nobody waits for: reading standard input cannot be called off.
pub(super) fn start(console: Console) -> Result<(), CommandError> {
    let thread = std::thread::Builder::new().name("control".to_owned());
    thread.spawn(move || listen(&console)).map(drop).map_err(CommandError::failed)
}

/// Until standard input ends: a run goes on without it.
fn listen(console: &Console) {
    let mut lines = Lines::default();
    let mut chunk = [0; 1024];
    loop {
        let count = match io::stdin().lock().read(&mut chunk) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(_) => break,
        };
        for &byte in &chunk[..count] {
            if let Some(line) = lines.push(byte)
                && !answered(console, &line)
            {
                return;
            }
        }
    }
    if let Some(line) = lines.end() {
        answered(console, &line);
    }
}

/// Whether to listen on: no other program speaks here, so a line that is no command ends nothing.
fn answered(console: &Console, line: &Line) -> bool {
    let answer = console.answer(line);
    let mut out = io::stdout().lock();
    let written = out.write_all(answer.line.as_bytes()).and_then(|()| out.flush());
    if answer.then == Then::Quit {
        console.quit();
    }
    written.is_ok() && answer.then != Then::Quit
}
