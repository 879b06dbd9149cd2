//! The eight bytes in front of every message, and the transfer of a whole message over a byte stream.
//!
//! ```text
//! 0        4      5       6        8
//! | length | type | flags | stream | body ...
//! ```
//!
//! `length` is the number of bytes of the body, little endian. `flags` and `stream` are zero in this version. A later
//! version can use them to compress or interleave without another header.

use std::fmt;

use bytes::{BufMut, Bytes};

use crate::ProtocolError;
use crate::limits::{MAX_CHUNK_BYTES, MAX_CONTROL_BYTES, MAX_PIXELS_BYTES, MAX_VIEW_BYTES};

#[cfg(feature = "transport")]
mod io;

#[cfg(feature = "transport")]
pub use io::{read_body, read_header};

/// Number of bytes of a header.
pub const HEADER_BYTES: usize = 8;

/// Number of bytes of the longest fixed-layout head between a header and the bulk bytes of a message.
pub(crate) const MAX_HEAD_BYTES: usize = 88;

/// Type of an envelope. The numbers are those of the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Kind {
    /// A worker introduces itself.
    Hello = 0x01,
    /// A master accepts a worker.
    Welcome = 0x02,
    /// A handshake is refused. The body is the reason as plain UTF-8, in every version.
    Refused = 0x03,
    /// Announcement of a frame whose leases may follow.
    Frame = 0x10,
    /// A lease.
    Segment = 0x11,
    /// Cancellation of all frames before a given one.
    Cancel = 0x12,
    /// Announcement of an asset that follows in chunks.
    AssetBegin = 0x13,
    /// A part of an asset.
    AssetChunk = 0x14,
    /// The sender does not have a requested asset.
    AssetUnknown = 0x15,
    /// Address of a worker that serves a requested asset.
    AssetFrom = 0x16,
    /// The key of the tokens that open assets at this worker.
    ShareKey = 0x17,
    /// Request for an asset.
    NeedAsset = 0x20,
    /// The rows of a lease.
    Pixels = 0x21,
    /// A worker cannot render a frame.
    Failed = 0x22,
    /// A worker serves assets to other workers.
    Sharing = 0x23,
    /// A worker has received all of an asset.
    HaveAsset = 0x24,
    /// Request for a pong; between workers a keepalive.
    Ping = 0x30,
    /// Reply to a ping.
    Pong = 0x31,
    /// Announcement that no more leases follow, or a request for none.
    Drain = 0x32,
    /// The last message of a session.
    Disconnect = 0x33,
    /// Request of a worker for an asset of another worker.
    PeerRequest = 0x40,
}

impl Kind {
    /// All types.
    pub const ALL: [Kind; 21] = [
        Self::Hello,
        Self::Welcome,
        Self::Refused,
        Self::Frame,
        Self::Segment,
        Self::Cancel,
        Self::AssetBegin,
        Self::AssetChunk,
        Self::AssetUnknown,
        Self::AssetFrom,
        Self::ShareKey,
        Self::NeedAsset,
        Self::Pixels,
        Self::Failed,
        Self::Sharing,
        Self::HaveAsset,
        Self::Ping,
        Self::Pong,
        Self::Drain,
        Self::Disconnect,
        Self::PeerRequest,
    ];

    /// Largest body of this type, in bytes.
    pub fn limit_bytes(self) -> usize {
        match self {
            Self::Frame => MAX_HEAD_BYTES + MAX_VIEW_BYTES,
            Self::AssetChunk => MAX_HEAD_BYTES + MAX_CHUNK_BYTES,
            Self::Pixels => MAX_HEAD_BYTES + MAX_PIXELS_BYTES,
            Self::Hello | Self::Welcome | Self::Refused => MAX_CONTROL_BYTES,
            Self::Segment | Self::Cancel | Self::AssetBegin | Self::AssetUnknown => MAX_CONTROL_BYTES,
            Self::AssetFrom | Self::ShareKey | Self::Sharing | Self::HaveAsset => MAX_CONTROL_BYTES,
            Self::NeedAsset | Self::Failed | Self::Ping | Self::Pong => MAX_CONTROL_BYTES,
            Self::Drain | Self::Disconnect | Self::PeerRequest => MAX_CONTROL_BYTES,
        }
    }

    fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| *kind as u8 == byte)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a {self:?} message")
    }
}

/// A validated header: its type is known, and its length is within the type's bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Type of the envelope.
    pub kind: Kind,
    /// Number of bytes of the body.
    pub body_bytes: usize,
}

impl Header {
    /// Reads and validates the eight bytes.
    ///
    /// # Errors
    /// An unknown type; nonzero flags or stream; more bytes than the type may have.
    pub fn parse(bytes: [u8; HEADER_BYTES]) -> Result<Self, ProtocolError> {
        let [l0, l1, l2, l3, kind, flags, s0, s1] = bytes;
        let kind = Kind::from_byte(kind).ok_or(ProtocolError::UnknownKind { kind })?;
        if flags != 0 || s0 != 0 || s1 != 0 {
            return Err(ProtocolError::malformed(kind, "its header has flags or a stream that must be zero"));
        }
        let body_bytes = within_limit(kind, u64::from(u32::from_le_bytes([l0, l1, l2, l3])))?;
        Ok(Self { kind, body_bytes })
    }
}

fn within_limit(kind: Kind, announced: u64) -> Result<usize, ProtocolError> {
    let limit = kind.limit_bytes();
    match usize::try_from(announced) {
        Ok(bytes) if bytes <= limit => Ok(bytes),
        _ => Err(ProtocolError::TooLong { kind, announced, limit: limit as u64 }),
    }
}

/// An outgoing message: header and fixed-layout head in one small array, and a body that other envelopes may share.
#[derive(Clone, Debug)]
pub struct Envelope {
    kind: Kind,
    lead: [u8; HEADER_BYTES + MAX_HEAD_BYTES],
    lead_bytes: usize,
    body: Bytes,
}

impl Envelope {
    /// Joins a header, `head` and `body`.
    ///
    /// # Errors
    /// More bytes than the type may have.
    pub(crate) fn new(kind: Kind, head: &[u8], body: Bytes) -> Result<Self, ProtocolError> {
        let announced = head.len() as u64 + body.len() as u64;
        let length = within_limit(kind, announced)? as u32;
        let mut lead = [0; HEADER_BYTES + MAX_HEAD_BYTES];
        let mut rest = lead.as_mut_slice();
        if head.len() > MAX_HEAD_BYTES {
            return Err(ProtocolError::malformed(kind, "its head is longer than the longest head"));
        }
        rest.put_u32_le(length);
        rest.put_u8(kind as u8);
        rest.put_bytes(0, 3);
        rest.put_slice(head);
        Ok(Self { kind, lead, lead_bytes: HEADER_BYTES + head.len(), body })
    }

    /// Type of the envelope.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Number of bytes on the wire, the header included.
    pub fn wire_bytes(&self) -> usize {
        self.lead_bytes + self.body.len()
    }

    /// Header and head as one slice, and the body that follows them on the wire.
    pub fn parts(&self) -> (&[u8], &Bytes) {
        (self.lead.get(..self.lead_bytes).unwrap_or_default(), &self.body)
    }
}
