//! What can go wrong between two peers, and what to do about it.

use std::fmt;
use std::io;
use std::time::Duration;

use crate::PROTOCOL_VERSION;
use crate::codec::CodecError;
use crate::envelope::Kind;

/// The two ends of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Hands out segments; listens.
    Master,
    /// Renders them; connects.
    Worker,
}

impl Role {
    /// The role at the other end.
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

/// Why a handshake or a session failed.
#[derive(Debug, thiserror::Error)]
pub enum ProtocolError {
    /// The transport failed.
    #[error("{doing}: {source}")]
    Io {
        /// What was being done.
        doing: &'static str,
        /// The transport's own error.
        source: io::Error,
    },

    /// The peer closed the connection where more had to come.
    #[error("the peer closed the connection {at}")]
    Closed {
        /// Where in the conversation.
        at: &'static str,
    },

    /// Something had begun and did not end in time.
    #[error("the peer did not finish {what} within {seconds} s", seconds = .limit.as_secs())]
    Deadline {
        /// What had begun.
        what: &'static str,
        /// How long it was waited for.
        limit: Duration,
    },

    /// The first bytes are not the magic: something else runs at the other end.
    #[error("the peer is no rayfarm {expected}: {what}; check the address and the port")]
    NotRayfarm {
        /// What should be there.
        expected: Role,
        /// What it said, and what that looks like.
        what: String,
    },

    /// Two masters, or two workers.
    #[error("both ends of the connection are {role}s; a worker connects to a master: check the address")]
    SameRole {
        /// What both are.
        role: Role,
    },

    /// The peer is of another release.
    #[error("{}", version_mismatch(*.our_role, PROTOCOL_VERSION, *.theirs))]
    Version {
        /// What we are.
        our_role: Role,
        /// The protocol version the peer speaks.
        theirs: u16,
    },

    /// The master does not want this worker.
    #[error("refused by the {by}: {reason}")]
    Refused {
        /// Who refused.
        by: Role,
        /// Why.
        reason: String,
    },

    /// The master does not take this worker now, and may later.
    #[error("the master does not take workers now: {reason}")]
    NotNow {
        /// Why.
        reason: String,
    },

    /// An envelope of a type that this version does not know.
    #[error("the peer sent an envelope of unknown type {kind:#04x}: these bytes are no message of rayfarm's")]
    UnknownKind {
        /// The type's byte.
        kind: u8,
    },

    /// An envelope that has no business in this direction or at this point.
    #[error("the peer sent {kind}, where {expected} was expected")]
    Unexpected {
        /// What came.
        kind: Kind,
        /// What could have come.
        expected: &'static str,
    },

    /// A header announces more than its type may carry. Nothing was allocated for it.
    #[error("{kind} announces {announced} bytes; at most {limit} are allowed")]
    TooLong {
        /// The envelope's type.
        kind: Kind,
        /// Bytes announced, or about to be sent.
        announced: u64,
        /// The bound.
        limit: u64,
    },

    /// An envelope whose content breaks a rule.
    #[error("{kind} is malformed: {why}")]
    Malformed {
        /// The envelope's type.
        kind: Kind,
        /// The rule.
        why: String,
    },

    /// An envelope whose body does not decode.
    #[error("{kind} does not decode: {source}")]
    Codec {
        /// The envelope's type.
        kind: Kind,
        /// What the codec said.
        source: CodecError,
    },
}

impl ProtocolError {
    /// Whether trying again would give the same answer: another release, another program, a refusal.
    pub fn is_final(&self) -> bool {
        match self {
            Self::NotRayfarm { .. } | Self::SameRole { .. } | Self::Version { .. } | Self::Refused { .. } => {
                true
            }
            Self::Io { .. } | Self::Closed { .. } | Self::Deadline { .. } | Self::NotNow { .. } => false,
            Self::UnknownKind { .. } | Self::Unexpected { .. } | Self::TooLong { .. } => false,
            Self::Malformed { .. } | Self::Codec { .. } => false,
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
        "this {our_role} speaks protocol version {ours}, the {peer} speaks version {theirs}; \
         install the same release of rayfarm on both machines (the {older}'s is the older one)"
    )
}
