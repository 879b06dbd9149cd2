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
    /// Lines since the start of the process.
    #[cfg(feature = "web")]
    recorded: u64,
    /// Number of the newest lines that have not been written, while a display holds them back.
    held: Option<usize>,
}

static LINES: Mutex<Lines> = Mutex::new(Lines {
    lines: VecDeque::new(),
    #[cfg(feature = "web")]
    recorded: 0,
    held: None,
});

fn with<T>(act: impl FnOnce(&mut Lines) -> T) -> T {
    act(&mut LINES.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Records a line as it is written, with its colours. Returns whether it is to be written now.
pub(crate) fn record(bytes: &[u8]) -> bool {
    let line = without_colors(&String::from_utf8_lossy(bytes));
    with(|lines| {
        lines.lines.push_back(line);
        #[cfg(feature = "web")]
        {
            lines.recorded += 1;
        }
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

/// The lines after the first `seen` of the process, at most the last `most`, and their number since the start of the process.
#[cfg(feature = "web")]
pub(crate) fn after(seen: u64, most: usize) -> (Vec<String>, u64) {
    with(|lines| {
        let unseen = usize::try_from(lines.recorded.saturating_sub(seen)).unwrap_or(usize::MAX);
        let count = unseen.min(most).min(lines.lines.len());
        let newest = lines.lines.iter().skip(lines.lines.len() - count);
        (newest.cloned().collect(), lines.recorded)
    })
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

    #[cfg(feature = "web")]
    #[test]
    fn lines_are_returned_once() {
        let (_, before) = after(0, 0);
        record(b"a line of a test\n");
        let (lines, now) = after(before, 100);
        assert!(lines.iter().any(|line| line == "a line of a test"), "{lines:?}");
        assert!(now > before);
        assert!(after(before, 0).0.is_empty());
        assert!(!after(now, 100).0.iter().any(|line| line == "a line of a test"));
    }

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
