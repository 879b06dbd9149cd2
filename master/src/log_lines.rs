//! The last lines of the log, for displays, and whether the log is written to standard error at once.

use std::collections::VecDeque;
use std::io::Write;
use std::sync::{Mutex, PoisonError};

/// Most lines that are kept.
const MAX_LINES: usize = 500;
/// Longest line that is kept, in bytes.
const MAX_LINE_BYTES: usize = 2000;

/// Lines of the log.
#[derive(Debug)]
struct Lines {
    lines: VecDeque<String>,
    /// Number of the newest lines that have not been written, while a display holds them back.
    held: Option<usize>,
}

static LINES: Mutex<Lines> = Mutex::new(Lines { lines: VecDeque::new(), held: None });

fn with<T>(act: impl FnOnce(&mut Lines) -> T) -> T {
    act(&mut LINES.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Records a line as it is written, with its colours. Returns whether it is to be written now.
pub(crate) fn record(bytes: &[u8]) -> bool {
    let line = without_colors(&String::from_utf8_lossy(bytes));
    with(|lines| {
        lines.lines.push_back(line);
        if lines.lines.len() > MAX_LINES {
            lines.lines.pop_front();
        }
        if let Some(held) = &mut lines.held {
            *held = (*held + 1).min(MAX_LINES);
        }
        lines.held.is_none()
    })
}

/// The newest line.
#[cfg(feature = "terminal")]
pub(crate) fn last() -> Option<String> {
    with(|lines| lines.lines.back().cloned())
}

/// Writes no line to standard error until [`release`].
#[cfg(feature = "terminal")]
pub(crate) fn hold_back() {
    with(|lines| lines.held = Some(0));
}

/// Writes the lines that were held back, the last ones if they are many, and all later lines at once.
pub(crate) fn release() {
    let held: Vec<String> = with(|lines| {
        let count = lines.held.take().unwrap_or(0).min(lines.lines.len());
        lines.lines.iter().skip(lines.lines.len() - count).cloned().collect()
    });
    let mut out = std::io::stderr().lock();
    for line in held {
        // Without standard error there is no other output to report it.
        let _ = writeln!(out, "{line}");
    }
}

/// A line without escape sequences of colours and its end, cut at the bound.
fn without_colors(line: &str) -> String {
    let mut plain = String::with_capacity(line.len());
    let mut rest = line.trim_end();
    while let Some((before, after)) = rest.split_once("\x1b[") {
        plain.push_str(before);
        rest = after.trim_start_matches(|letter: char| letter.is_ascii_digit() || letter == ';');
        rest = rest.strip_prefix('m').unwrap_or(rest);
    }
    plain.push_str(rest);
    rayfarm_text::cut(&plain, MAX_LINE_BYTES).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_removed_and_text_is_kept() {
        assert_eq!(
            without_colors("\x1b[2m12:00:00Z\x1b[0m \x1b[32m INFO\x1b[0m joins\n"),
            "12:00:00Z  INFO joins"
        );
        assert_eq!(without_colors("plain [1m text"), "plain [1m text");
        assert_eq!(without_colors("\x1b["), "");
        assert_eq!(without_colors(&"x".repeat(5000)).len(), MAX_LINE_BYTES);
    }
}
