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

/// Bytes of a header.
pub const HEADER_BYTES: usize = 8;

/// Bytes of the longest hand-laid head between a header and the bulk bytes of a message.
pub(crate) const MAX_HEAD_BYTES: usize = 88;

/// The types of envelopes. Their numbers are the wire's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Kind {
    /// A worker says who it is.
    Hello = 0x01,
    /// A master takes a worker.
    Welcome = 0x02,
    /// A handshake ends here; the body is the reason as plain UTF-8, whatever the version.
    Refused = 0x03,
    /// A frame that leases may follow for.
    Frame = 0x10,
    /// A lease.
    Segment = 0x11,
    /// Frames before this one are stale.
    Cancel = 0x12,
    /// An asset follows in chunks.
    AssetBegin = 0x13,
    /// A part of an asset.
    AssetChunk = 0x14,
    /// The master does not have that asset.
    AssetUnknown = 0x15,
    /// Another worker passes an asset on.
    AssetFrom = 0x16,
    /// What a worker shares with its master alone.
    ShareKey = 0x17,
    /// A worker lacks an asset.
    NeedAsset = 0x20,
    /// The rows of a lease.
    Pixels = 0x21,
    /// A worker cannot render a frame.
    Failed = 0x22,
    /// A worker passes assets on.
    Sharing = 0x23,
    /// A worker has all of an asset.
    HaveAsset = 0x24,
    /// Asks for a pong.
    Ping = 0x30,
    /// Answers a ping.
    Pong = 0x31,
    /// No more leases for this worker.
    Drain = 0x32,
    /// The last message of a session.
    Goodbye = 0x33,
    /// A worker asks another one for an asset.
    Fetch = 0x40,
}

impl Kind {
    /// Every type there is.
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
        Self::Goodbye,
        Self::Fetch,
    ];

    /// The longest body that this type may have.
    pub fn limit_bytes(self) -> usize {
        match self {
            Self::Frame => MAX_HEAD_BYTES + MAX_VIEW_BYTES,
            Self::AssetChunk => MAX_HEAD_BYTES + MAX_CHUNK_BYTES,
            Self::Pixels => MAX_HEAD_BYTES + MAX_PIXELS_BYTES,
            Self::Hello | Self::Welcome | Self::Refused => MAX_CONTROL_BYTES,
            Self::Segment | Self::Cancel | Self::AssetBegin | Self::AssetUnknown => MAX_CONTROL_BYTES,
            Self::AssetFrom | Self::ShareKey | Self::Sharing | Self::HaveAsset => MAX_CONTROL_BYTES,
            Self::NeedAsset | Self::Failed | Self::Ping | Self::Pong => MAX_CONTROL_BYTES,
            Self::Drain | Self::Goodbye | Self::Fetch => MAX_CONTROL_BYTES,
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

/// A checked header: its type is known and its length is within the type's bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// The type.
    pub kind: Kind,
    /// Bytes of the body.
    pub body_bytes: usize,
}

impl Header {
    /// Reads and checks the eight bytes.
    ///
    /// # Errors
    /// Unknown type, flags or stream that this version does not use, more bytes than the type may have.
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

/// A message on its way out: header and hand-laid head in one small array, the body shared with whoever else sends it.
#[derive(Clone, Debug)]
pub struct Envelope {
    kind: Kind,
    lead: [u8; HEADER_BYTES + MAX_HEAD_BYTES],
    lead_bytes: usize,
    body: Bytes,
}

impl Envelope {
    /// Puts `head` and `body` behind a header.
    ///
    /// # Errors
    /// When together they are longer than the type may be.
    pub(crate) fn new(kind: Kind, head: &[u8], body: Bytes) -> Result<Self, ProtocolError> {
        let announced = head.len() as u64 + body.len() as u64;
        let length = within_limit(kind, announced)? as u32;
        let mut lead = [0; HEADER_BYTES + MAX_HEAD_BYTES];
        let mut rest = lead.as_mut_slice();
        if head.len() > MAX_HEAD_BYTES {
            return Err(ProtocolError::malformed(kind, "its head is longer than any head"));
        }
        rest.put_u32_le(length);
        rest.put_u8(kind as u8);
        rest.put_bytes(0, 3);
        rest.put_slice(head);
        Ok(Self { kind, lead, lead_bytes: HEADER_BYTES + head.len(), body })
    }

    /// The type.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Bytes on the wire, the header included.
    pub fn wire_bytes(&self) -> usize {
        self.lead_bytes + self.body.len()
    }

    /// Header and head, and the body that follows them on the wire.
    pub fn parts(&self) -> (&[u8], &Bytes) {
        (self.lead.get(..self.lead_bytes).unwrap_or_default(), &self.body)
    }
}
