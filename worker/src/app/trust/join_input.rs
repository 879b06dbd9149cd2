//! Reads join lines from a command line, standard input or the environment.

use std::fmt;
use std::io::{self, Read};
use std::str::FromStr;

use rayfarm_protocol::transport::{JoinLine, JoinLineError};

/// Environment variable with a join line. It is not passed on to child processes.
pub(in crate::app) const JOIN_VARIABLE: &str = "RAYFARM_JOIN";

/// Longest line that is read, in bytes.
const MAX_LINE_BYTES: usize = 1024;

/// Value of `--join`.
#[derive(Clone, PartialEq, Eq)]
pub enum JoinInput {
    /// A join line on the command line, where other users of the machine can read it.
    Line(JoinLine),
    /// The first line of standard input.
    Stdin,
}

impl fmt::Debug for JoinInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Line(_) => "Line(..)",
            Self::Stdin => "Stdin",
        })
    }
}

impl FromStr for JoinInput {
    type Err = JoinLineError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text == "-" { Ok(Self::Stdin) } else { text.parse().map(Self::Line) }
    }
}

impl JoinInput {
    /// Returns the join line. Reads no byte of standard input after the end of the line.
    ///
    /// # Errors
    /// Standard input without a valid join line. The message does not contain the line.
    pub(in crate::app) fn line(&self) -> Result<JoinLine, String> {
        match self {
            Self::Line(line) => Ok(line.clone()),
            Self::Stdin => {
                let text = read_line(io::stdin().lock())
                    .map_err(|error| format!("no join line on standard input: {error}"))?;
                text.parse().map_err(|error| format!("standard input: {error}"))
            }
        }
    }

    /// Returns the join line of the environment, if there is one.
    ///
    /// # Errors
    /// A variable that holds no valid join line.
    pub(in crate::app) fn of_environment() -> Result<Option<JoinLine>, String> {
        match std::env::var(JOIN_VARIABLE) {
            Ok(text) if text.is_empty() => Ok(None),
            Ok(text) => text.parse().map(Some).map_err(|error| format!("{JOIN_VARIABLE}: {error}")),
            Err(std::env::VarError::NotPresent) => Ok(None),
            Err(std::env::VarError::NotUnicode(_)) => Err(format!("{JOIN_VARIABLE}: it is not Unicode text")),
        }
    }
}

/// Reads up to the first line feed, or to the end of the input, and no further.
///
/// # Errors
/// A line of more than [`MAX_LINE_BYTES`], other text than UTF-8, and errors of the input.
pub(in crate::app) fn read_line(mut input: impl Read) -> io::Result<String> {
    let mut line = Vec::new();
    let mut byte = [0];
    loop {
        match input.read(&mut byte) {
            Ok(0) => break,
            Ok(_) if byte == [b'\n'] => break,
            Ok(_) if line.len() == MAX_LINE_BYTES => {
                return Err(io::Error::other(format!("the line has more than {MAX_LINE_BYTES} bytes")));
            }
            Ok(_) => line.extend_from_slice(&byte),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    String::from_utf8(line).map_err(|_| io::Error::other("the line is not UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_line_is_read_and_the_rest_is_left() {
        let mut input = &b"first\r\nsecond\nthird"[..];
        assert_eq!(read_line(&mut input).unwrap(), "first\r");
        assert_eq!(read_line(&mut input).unwrap(), "second");
        assert_eq!(read_line(&mut input).unwrap(), "third");
        assert_eq!(read_line(&mut input).unwrap(), "");
    }

    #[test]
    fn long_and_invalid_lines_are_refused() {
        assert_eq!(read_line(&[b'a'; MAX_LINE_BYTES][..]).unwrap().len(), MAX_LINE_BYTES);
        assert!(read_line(io::repeat(b'a')).is_err());
        assert!(read_line(&b"\xff\n"[..]).is_err());
    }

    #[test]
    fn neither_debug_output_nor_errors_contain_a_token() {
        let token = "0123456789abcdef0123456789abcdef";
        let text = format!("rf1:farm:7117:{}:{token}", "ab".repeat(32));
        let input: JoinInput = text.parse().unwrap();
        assert!(!format!("{input:?}").contains(token));
        assert_eq!(input.line().unwrap().to_string(), text);
        let error = format!("rf1:farm:0:{}:{token}", "ab".repeat(32)).parse::<JoinInput>().unwrap_err();
        assert!(!error.to_string().contains(token), "{error}");
        assert_eq!("-".parse::<JoinInput>().unwrap(), JoinInput::Stdin);
    }
}
