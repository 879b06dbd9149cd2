//! Errors between two peers, with what to do about them.

use std::fmt;
use std::io;
use std::time::Duration;

use crate::codec::CodecError;
use crate::kind::Kind;
use crate::{KeyHash, PROTOCOL_VERSION};

/// One of the two ends of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The end that listens and leases segments.
    Master,
    /// The end that connects and renders segments.
    Worker,
}

impl Role {
    /// Role of the other end.
    pub fn peer(self) -> Self {
        match self {
            Self::Master => Self::Worker,
            Self::Worker => Self::Master,
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Master => "master",
            Self::Worker => "worker",
        })
    }
}

/// Error of a handshake, a session or a message.
#[derive(Debug, thiserror::Error)]
pub enum ProtocolError {
    /// The transport failed.
    #[error("{doing}: {source}")]
    Io {
        /// The operation that failed.
        doing: &'static str,
        /// Error of the transport.
        source: io::Error,
    },

    /// The peer closed the connection in the middle of an exchange.
    #[error("the peer closed the connection {at}")]
    Closed {
        /// Position in the exchange.
        at: &'static str,
    },

    /// The peer began something and did not finish it in time.
    #[error("the peer did not finish {what} within {seconds} s", seconds = .limit.as_secs())]
    Deadline {
        /// Exchange that the peer has not finished.
        what: &'static str,
        /// The time limit.
        limit: Duration,
    },

    /// The first bytes are not the magic: another program runs at the other end.
    #[error("the peer is no rayfarm {expected}: {what}; check the address and the port")]
    NotRayfarm {
        /// Role that was expected at the other end.
        expected: Role,
        /// The bytes that arrived, and the protocol that they belong to.
        what: String,
    },

    /// Both ends are masters, or both are workers.
    #[error("both ends of the connection are {role}s; a worker connects to a master: check the address")]
    SameRole {
        /// Role of both ends.
        role: Role,
    },

    /// The peer's release uses another version of the protocol.
    #[error("{}", version_mismatch(*.our_role, PROTOCOL_VERSION, *.theirs))]
    Version {
        /// Role of this end.
        our_role: Role,
        /// Protocol version of the peer.
        theirs: u16,
    },

    /// One end uses TLS and the other does not.
    #[error("{}", transport_mismatch(*.our_role, *.encrypted))]
    Transport {
        /// Role of this end.
        our_role: Role,
        /// Whether this end uses TLS.
        encrypted: bool,
    },

    /// The master has another key than the join line.
    #[error(
        "the master has another key ({}) than the join line ({}): it was reinstalled, its key was rotated, or another \
         machine answers; copy the join line that the master prints now", .theirs.short(), .expected.short()
    )]
    WrongKey {
        /// Hash of the key at the other end.
        theirs: KeyHash,
        /// Hash in the join line.
        expected: KeyHash,
    },

    /// The worker has not proved the farm's token.
    #[error(
        "the worker does not know the farm's token, which may have been rotated; \
         start it with the join line that the master prints now"
    )]
    WrongToken,

    /// The TLS handshake failed.
    #[error("no encrypted connection: {why}")]
    Tls {
        /// Error of the TLS library.
        why: String,
    },

    /// The master refused this worker.
    #[error("refused by the {by}: {reason}")]
    Refused {
        /// Role of the end that refused.
        by: Role,
        /// The master's reason.
        reason: String,
    },

    /// The master does not accept this worker now, and may accept it later.
    #[error("the master does not accept workers now: {reason}")]
    NotNow {
        /// The master's reason.
        reason: String,
    },

    /// An envelope has a type that this version does not know.
    #[error("the peer sent an envelope of unknown type {kind:#04x}: the bytes are no message of rayfarm")]
    UnknownKind {
        /// Byte of the type.
        kind: u8,
    },

    /// An envelope has a type that is not allowed in this direction or at this point.
    #[error("the peer sent {kind}, where {expected} was expected")]
    Unexpected {
        /// Type of the envelope.
        kind: Kind,
        /// Description of the allowed types.
        expected: &'static str,
    },

    /// A header announces more bytes than its type may have. Nothing was allocated for them.
    #[error("{kind} announces {announced} bytes; at most {limit} are allowed")]
    TooLong {
        /// Type of the envelope.
        kind: Kind,
        /// Number of bytes announced, or about to be sent.
        announced: u64,
        /// Largest number allowed.
        limit: u64,
    },

    /// A header announces more pixels than the leases of the session can need. Nothing was allocated for them.
    #[error("pixels of {announced} bytes are announced; the open leases need at most {limit}")]
    NotLeased {
        /// Number of bytes announced.
        announced: u64,
        /// Largest number that an open lease needs; 0 without leases.
        limit: u64,
    },

    /// The content of an envelope breaks a rule.
    #[error("{kind} is malformed: {why}")]
    Malformed {
        /// Type of the envelope.
        kind: Kind,
        /// The rule and the offending value.
        why: String,
    },

    /// The body of an envelope does not decode.
    #[error("{kind} does not decode: {source}")]
    Codec {
        /// Type of the envelope.
        kind: Kind,
        /// Error of the codec.
        source: CodecError,
    },
}

impl ProtocolError {
    /// Whether a worker must not try again: a refusal by a master that has proved its key.
    ///
    /// `encrypted`: whether the worker uses TLS. Without it nothing is final, because a false master may have sent it. With
    /// it only a refusal is final: it alone arrives after the proof of the key.
    pub fn is_final(&self, encrypted: bool) -> bool {
        match self {
            Self::Refused { .. } => encrypted,
            Self::NotRayfarm { .. } | Self::SameRole { .. } | Self::Transport { .. } => false,
            Self::Version { .. } | Self::WrongKey { .. } | Self::WrongToken | Self::Tls { .. } => false,
            Self::Io { .. } | Self::Closed { .. } | Self::Deadline { .. } | Self::NotNow { .. } => false,
            Self::UnknownKind { .. } | Self::Unexpected { .. } | Self::TooLong { .. } => false,
            Self::NotLeased { .. } | Self::Malformed { .. } | Self::Codec { .. } => false,
        }
    }

    pub(crate) fn malformed(kind: Kind, why: impl Into<String>) -> Self {
        Self::Malformed { kind, why: why.into() }
    }
}

fn version_mismatch(our_role: Role, ours: u16, theirs: u16) -> String {
    let peer = our_role.peer();
    let older = if ours < theirs { our_role } else { peer };
    format!(
        "this {our_role} has protocol version {ours}, the {peer} has version {theirs}; \
         install the same release of rayfarm on both machines (the {older}'s is the older one)"
    )
}

fn transport_mismatch(our_role: Role, encrypted: bool) -> &'static str {
    match (our_role, encrypted) {
        (Role::Master, true) | (Role::Worker, false) => {
            "the master requires an encrypted connection, which the worker does not use; \
             start the worker with the join line that the master prints: rayfarm-worker --join rf1:..."
        }
        (Role::Master, false) | (Role::Worker, true) => {
            "the worker requires an encrypted connection by its join line, which the master does not use; \
             start the master without --insecure, or the worker without a join line"
        }
    }
}
