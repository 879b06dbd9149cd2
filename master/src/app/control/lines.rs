//! Bytes into lines of bounded length.

/// Bytes that a command line may have.
pub(super) const MAX_LINE_BYTES: usize = 1024;

/// Cuts a stream into lines, however it arrives. Holds [`MAX_LINE_BYTES`] at most.
#[derive(Debug, Default)]
pub(super) struct Lines {
    line: Vec<u8>,
    /// The rest of the line is worth nothing.
    skips: bool,
}

/// One line, without its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Line {
    /// What it says; bytes that are no text are replaced.
    Text(String),
    /// It is longer than it may be. Known at once; the rest of it is skipped.
    TooLong,
    /// It has a byte that no text has: it is of another protocol. Likewise.
    Binary,
}

impl Lines {
    /// Takes the next byte; the line that it ends or spoils, if it does. `\r\n` counts as `\n`.
    pub(super) fn push(&mut self, byte: u8) -> Option<Line> {
        match byte {
            b'\n' if std::mem::take(&mut self.skips) => None,
            b'\n' => Some(self.take()),
            _ if self.skips => None,
            0..=8 | 11..=12 | 14..=31 | 127 => self.spoil(Line::Binary),
            _ if self.line.len() == MAX_LINE_BYTES => self.spoil(Line::TooLong),
            _ => {
                self.line.push(byte);
                None
            }
        }
    }

    /// The stream is over: the line that nothing has ended, if there is one.
    pub(super) fn end(&mut self) -> Option<Line> {
        (!self.line.is_empty()).then(|| self.take())
    }

    fn take(&mut self) -> Line {
        let line = std::mem::take(&mut self.line);
        let line = line.strip_suffix(b"\r").unwrap_or(&line);
        Line::Text(String::from_utf8_lossy(line).into_owned())
    }

    fn spoil(&mut self, why: Line) -> Option<Line> {
        self.line.clear();
        self.skips = true;
        Some(why)
    }
}

/// Whether a line is of another protocol. A web page can have its visitor's browser talk to the ports of this machine: a
/// request begins with a method and names HTTP, its fields have a colon after their first word. No command does.
pub(super) fn is_foreign(line: &str) -> bool {
    let word = line.split_whitespace().next().unwrap_or_default();
    let is_method = word.len() > 1 && word.bytes().all(|byte| byte.is_ascii_uppercase() || byte == b'-');
    let is_text = line.chars().all(|c| c == '\t' || !(c.is_control() || c == char::REPLACEMENT_CHARACTER));
    is_method || word.contains(':') || line.to_ascii_uppercase().contains("HTTP/") || !is_text
}
