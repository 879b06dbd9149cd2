//! Commands on standard input, answers on standard output.

use std::io::{self, Read, Write};

use super::console::{Console, Then};
use super::lines::{Line, LineSplitter};
use crate::error::CommandError;

/// Reads commands on a thread of its own. It is never joined, because reading standard input cannot be cancelled.
pub(super) fn start(console: Console) -> Result<(), CommandError> {
    let thread = std::thread::Builder::new().name("control".to_owned());
    thread.spawn(move || listen(&console)).map(drop).map_err(CommandError::failed)
}

/// Answers commands until standard input ends; the run goes on after that.
fn listen(console: &Console) {
    let mut lines = LineSplitter::default();
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

/// Answers a line. Returns whether to go on; a wrong line is no reason to stop, because no other protocol arrives here.
fn answered(console: &Console, line: &Line) -> bool {
    let answer = console.answer(line);
    let mut out = io::stdout().lock();
    let written = out.write_all(answer.line.as_bytes()).and_then(|()| out.flush());
    if answer.then == Then::Quit {
        console.quit();
    }
    written.is_ok() && answer.then != Then::Quit
}
