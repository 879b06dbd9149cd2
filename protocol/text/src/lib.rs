//! Escaping of untrusted text for logs, terminals and windows.
//!
//! Names, reasons and errors of peers, and keys, words and names of files are printed. [`printable`] escapes
//! characters that move a cursor, forge a line, are invisible, reorder their neighbours or pile up;
//! [`printable_within`] limits the length as well. All other text is unchanged, in every script.
//!
//! ```
//! use rayfarm_text::{printable, printable_within};
//!
//! assert_eq!(printable("mill\n2\u{202e}"), r"mill\n2\u{202e}");
//! assert_eq!(printable_within("a long name", 8), "a lon…");
//! ```

mod invisible;

use std::borrow::Cow;
use std::fmt::Write;

use unicode_width::UnicodeWidthChar;

use invisible::is_invisible;

/// Largest number of marks on one character: no language uses more.
const MAX_MARKS: usize = 4;
/// Substitute for text without a character.
const EMPTY: &str = "(empty)";
/// Substitute for text of blanks.
const BLANK: &str = "(blank)";
/// Ending of truncated text.
const CUT: &str = "…";

/// The text with escapes, such as `\n` or `\u{202e}`, for all characters that are invisible or affect others: control
/// characters, separators of lines and paragraphs, bidirectional and zero-width characters, tags, variation
/// selectors, private use, and marks beyond the fourth on one character. Text without any visible character becomes
/// `(empty)` or `(blank)`, so the result is never empty. The function is idempotent.
pub fn printable(text: &str) -> Cow<'_, str> {
    if text.is_empty() {
        return Cow::Borrowed(EMPTY);
    }
    if text.chars().all(|c| c.is_whitespace() && !is_unprintable(c)) {
        return Cow::Borrowed(BLANK);
    }
    let Some(first) = escapes(text).find(|(_, _, escaped)| *escaped).map(|(at, ..)| at) else {
        return Cow::Borrowed(text);
    };
    let mut shown = text.get(..first).unwrap_or_default().to_owned();
    for (_, c, escaped) in escapes(text).filter(|(at, ..)| *at >= first) {
        push(&mut shown, c, escaped);
    }
    Cow::Owned(shown)
}

/// The text as from [`printable`], truncated to `max_bytes` bytes. Truncated text ends in `…`; no escape is split.
pub fn printable_within(text: &str, max_bytes: usize) -> Cow<'_, str> {
    // The text far beyond the limit is not processed: a printed character has no fewer bytes than the original.
    let head = cut(text, max_bytes.saturating_add(CUT.len()).max(EMPTY.len()));
    let shown = printable(head);
    if shown.len() <= max_bytes && (head.len() == text.len() || shown == BLANK) {
        return shown;
    }
    let room = max_bytes.saturating_sub(CUT.len());
    let mut kept = String::new();
    let mut piece = String::new();
    for (_, c, escaped) in escapes(head) {
        piece.clear();
        push(&mut piece, c, escaped);
        if kept.len() + piece.len() > room {
            break;
        }
        kept.push_str(&piece);
    }
    kept.push_str(cut(CUT, max_bytes));
    Cow::Owned(kept)
}

/// The longest prefix of at most `max_bytes` bytes that ends at a character boundary.
pub fn cut(text: &str, max_bytes: usize) -> &str {
    let mut end = text.len().min(max_bytes);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    text.get(..end).unwrap_or_default()
}

/// Each character with its offset and whether it is escaped.
fn escapes(text: &str) -> impl Iterator<Item = (usize, char, bool)> {
    // A mark at the beginning would combine with the last character before the text.
    let mut marks = MAX_MARKS;
    text.char_indices().map(move |(at, c)| {
        if is_unprintable(c) {
            // A mark behind an escape would combine with the escape's last character.
            marks = MAX_MARKS;
            return (at, c, true);
        }
        let is_mark = c.width() == Some(0);
        let escaped = is_mark && marks >= MAX_MARKS;
        marks = match (is_mark, escaped, c.is_whitespace()) {
            (true, ..) => (marks + 1).min(MAX_MARKS),
            (false, _, true) => MAX_MARKS,
            (false, ..) => 0,
        };
        (at, c, escaped)
    })
}

fn is_unprintable(c: char) -> bool {
    c.is_control() || is_invisible(c)
}

fn push(shown: &mut String, c: char, escaped: bool) {
    match (escaped, c) {
        (false, c) => shown.push(c),
        (true, '\n') => shown.push_str("\\n"),
        (true, '\r') => shown.push_str("\\r"),
        (true, '\t') => shown.push_str("\\t"),
        (true, c) => {
            // Writing to a string cannot fail.
            let _ = write!(shown, "\\u{{{:x}}}", u32::from(c));
        }
    }
}

#[cfg(test)]
mod tests;
