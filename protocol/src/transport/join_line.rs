//! The line of text with which a worker joins a farm: address, key and token of the master.

use std::fmt;
use std::str::FromStr;

use crate::{KeyHash, hex};

/// First characters of every join line: the format and its version.
const PREFIX: &str = "rf1:";

/// Longest text that is read as a join line, in bytes.
const MAX_LINE_BYTES: usize = 1024;

/// Longest host name, in bytes (RFC 1035).
const MAX_HOST_BYTES: usize = 255;

/// Longest name of a network interface as the scope of an address, in bytes.
const MAX_SCOPE_BYTES: usize = 32;

/// Secret of a farm that lets a worker join it, 128 random bits. As text it has 32 hexadecimal digits.
#[derive(Clone, Copy)]
pub struct JoinToken(pub [u8; 16]);

/// What a worker must know to join a farm: `rf1:HOST:PORT:KEY:TOKEN`.
///
/// Its text contains the token, so it belongs in no log and no process list.
#[derive(Clone, PartialEq, Eq)]
pub struct JoinLine {
    /// Address of the master as HOST:PORT, or \[IPv6\]:PORT.
    pub address: String,
    /// Hash of the master's public key.
    pub key: KeyHash,
    /// Token of the farm.
    pub token: JoinToken,
}

/// Error of reading a join line or a token. It names the part that is wrong and never contains the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JoinLineError {
    /// The text does not begin with the prefix.
    #[error("a join line begins with \"rf1:\"; copy the whole line that the master prints")]
    Prefix,
    /// A part is missing, or the text is far too long.
    #[error("a join line has the form rf1:HOST:PORT:KEY:TOKEN; copy the whole line that the master prints")]
    Form,
    /// The address has no valid host.
    #[error("the host of the join line is invalid; an IPv6 address needs brackets, as in [::1]")]
    Host,
    /// The address has no valid port.
    #[error("the port of the join line is not a number from 1 to 65535")]
    Port,
    /// The hash of the key is malformed.
    #[error(
        "the key of the join line is not 64 hexadecimal digits; copy the whole line that the master prints"
    )]
    Key,
    /// The token is malformed.
    #[error("the token is not 32 hexadecimal digits; copy the whole line that the master prints")]
    Token,
}

impl JoinToken {
    /// Makes a token of the system's random numbers.
    ///
    /// # Errors
    /// A system without random numbers.
    pub fn random() -> std::io::Result<Self> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).map_err(|error| std::io::Error::other(error.to_string()))?;
        Ok(Self(bytes))
    }
}

impl PartialEq for JoinToken {
    /// Compares in constant time.
    fn eq(&self, other: &Self) -> bool {
        subtle::ConstantTimeEq::ct_eq(&self.0[..], &other.0[..]).into()
    }
}

impl Eq for JoinToken {}

impl fmt::Debug for JoinToken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JoinToken(..)")
    }
}

impl fmt::Display for JoinToken {
    /// Writes the secret.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        hex::write(&self.0, f)
    }
}

impl FromStr for JoinToken {
    type Err = JoinLineError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        hex::read(text).map(Self).ok_or(JoinLineError::Token)
    }
}

impl fmt::Debug for JoinLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { address, key, token } = self;
        write!(f, "JoinLine({address}, {key:?}, {token:?})")
    }
}

impl fmt::Display for JoinLine {
    /// Writes the line, with the secret.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { address, key, token } = self;
        write!(f, "{PREFIX}{address}:{key}:{token}")
    }
}

impl FromStr for JoinLine {
    type Err = JoinLineError;

    /// Reads a join line. A whole command line that ends in one is accepted, with or without quotes around the line.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text.len() > MAX_LINE_BYTES {
            return Err(JoinLineError::Form);
        }
        let is_quote = |c: char| matches!(c, '"' | '\'');
        let mut words = text.split_whitespace().map(|word| word.trim_matches(is_quote));
        let line = words.find_map(|word| {
            word.strip_prefix("--join=").unwrap_or(word).trim_matches(is_quote).strip_prefix(PREFIX)
        });
        let line = line.ok_or(JoinLineError::Prefix)?;
        if words.next().is_some() {
            return Err(JoinLineError::Form);
        }
        let mut parts = line.rsplitn(4, ':');
        let (token, key, port, host) = (parts.next(), parts.next(), parts.next(), parts.next());
        let (Some(token), Some(key), Some(port), Some(host)) = (token, key, port, host) else {
            return Err(JoinLineError::Form);
        };
        let token = token.parse()?;
        let key = key.parse().map_err(|_| JoinLineError::Key)?;
        let is_port =
            port.bytes().all(|byte| byte.is_ascii_digit()) && port.parse::<u16>().is_ok_and(|port| port > 0);
        if !is_port {
            return Err(JoinLineError::Port);
        }
        if !is_host(host) {
            return Err(JoinLineError::Host);
        }
        Ok(Self { address: format!("{host}:{port}"), key, token })
    }
}

fn is_plain(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'-' | b'_')
}

/// Whether a text is an IPv6 address in brackets, or characters of a host name or an IPv4 address.
fn is_host(host: &str) -> bool {
    if let Some(inner) = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
        let (address, scope) = inner.split_once('%').unwrap_or((inner, "0"));
        let is_scope = (1..=MAX_SCOPE_BYTES).contains(&scope.len()) && scope.bytes().all(is_plain);
        return address.parse::<std::net::Ipv6Addr>().is_ok() && is_scope;
    }
    (1..=MAX_HOST_BYTES).contains(&host.len()) && host.bytes().all(is_plain) && !host.starts_with('-')
}
