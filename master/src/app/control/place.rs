//! Places at which commands are accepted.

use std::net::SocketAddr;
use std::path::PathBuf;

use rayfarm_protocol::address;

/// The value of `--control`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// `-`: standard input.
    StandardInput,
    /// `ADDR:PORT`: a port of a loopback address.
    Tcp(SocketAddr),
    /// A path: a Unix socket, created there.
    Unix(PathBuf),
}

impl Place {
    /// Parses the value of `--control`.
    ///
    /// # Errors
    /// The expected syntax; or an address that other machines can reach, with the reason for the refusal.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        if text == "-" {
            return Ok(Self::StandardInput);
        }
        match address::parse(text)? {
            Some(address) if address.ip().is_loopback() => Ok(Self::Tcp(address)),
            Some(address) => Err(format!(
                "{} can be reached by other machines, which could then command the run; expected a loopback address, such \
                 as 127.0.0.1:{}",
                address.ip(),
                address.port()
            )),
            None if text.contains('/') => Ok(Self::Unix(text.into())),
            None => Err(
                "expected - for standard input, an address such as 127.0.0.1:7118, or a path with a slash in it, \
                 such as ./control, for a Unix socket"
                    .to_owned(),
            ),
        }
    }
}
