//! Bytes into lines of bounded length.

/// Bytes that a command line may have.
pub(super) const MAX_LINE_BYTES: usize = 1024;

/// Cuts a stream into lines, however it arrives. Holds [`MAX_LINE_BYTES`] at most.
#[derive(Debug, Default)]
pub(super) struct Lines {
    line: Vec<u8>,
    too_long: bool,
}

/// One line, without its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Line {
    /// What stands there; bytes that are no text are replaced.
    Text(String),
    /// It was longer than it may be, and is lost.
    TooLong,
}

impl Lines {
    /// Takes the next byte; the line that it ends, if it ends one. `\r\n` counts as `\n`.
    pub(super) fn push(&mut self, byte: u8) -> Option<Line> {
        if byte == b'\n' {
            return Some(self.take());
        }
        match self.line.len() {
            MAX_LINE_BYTES => self.too_long = true,
            _ => self.line.push(byte),
        }
        None
    }

    /// The stream is over: the line that nothing has ended, if there is one.
    pub(super) fn end(&mut self) -> Option<Line> {
        (!self.line.is_empty()).then(|| self.take())
    }

    fn take(&mut self) -> Line {
        let line = std::mem::take(&mut self.line);
        if std::mem::take(&mut self.too_long) {
            return Line::TooLong;
        }
        let line = line.strip_suffix(b"\r").unwrap_or(&line);
        Line::Text(String::from_utf8_lossy(line).into_owned())
    }
}
