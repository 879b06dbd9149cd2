//! Splitting of bytes into lines of bounded length.

/// Largest length of a command, in bytes.
pub(super) const MAX_LINE_BYTES: usize = 1024;

/// Splitter of a stream into lines. Holds at most [`MAX_LINE_BYTES`].
#[derive(Debug, Default)]
pub(super) struct LineSplitter {
    line: Vec<u8>,
    /// Whether the rest of the line is skipped.
    skips: bool,
}

/// One line, without its newline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Line {
    /// Text; bytes that are not UTF-8 are replaced.
    Text(String),
    /// A line beyond the largest length. Returned at once; the rest of it is skipped.
    TooLong,
    /// A line with a control character, of another protocol. Returned at once; the rest of it is skipped.
    Binary,
}

impl LineSplitter {
    /// Takes the next byte. Returns the line that it completes or makes invalid. `\r\n` counts as `\n`.
    pub(super) fn push(&mut self, byte: u8) -> Option<Line> {
        match byte {
            b'\n' if std::mem::take(&mut self.skips) => None,
            b'\n' => Some(self.take()),
            _ if self.skips => None,
            0..=8 | 11..=12 | 14..=31 | 127 => self.reject(Line::Binary),
            _ if self.line.len() == MAX_LINE_BYTES => self.reject(Line::TooLong),
            _ => {
                self.line.push(byte);
                None
            }
        }
    }

    /// Ends the stream. Returns the last line if it has no newline.
    pub(super) fn end(&mut self) -> Option<Line> {
        (!self.line.is_empty()).then(|| self.take())
    }

    fn take(&mut self) -> Line {
        let line = std::mem::take(&mut self.line);
        let line = line.strip_suffix(b"\r").unwrap_or(&line);
        Line::Text(String::from_utf8_lossy(line).into_owned())
    }

    fn reject(&mut self, reason: Line) -> Option<Line> {
        self.line.clear();
        self.skips = true;
        Some(reason)
    }
}

/// Whether a line is of another protocol. A web page can make its visitor's browser connect to the ports of this machine: a
/// request begins with a method and names HTTP, and its fields have a colon after their first word. Commands have neither.
pub(super) fn is_foreign(line: &str) -> bool {
    let word = line.split_whitespace().next().unwrap_or_default();
    let is_method = word.len() > 1 && word.bytes().all(|byte| byte.is_ascii_uppercase() || byte == b'-');
    let is_text = line.chars().all(|c| c == '\t' || !(c.is_control() || c == char::REPLACEMENT_CHARACTER));
    is_method || word.contains(':') || line.to_ascii_uppercase().contains("HTTP/") || !is_text
}
