//! The eight bytes in front of every message, and the transfer of a whole message over a byte stream.
//!
//! ```text
//! 0        4      5       6        8
//! | length | type | flags | stream | body ...
//! ```
//!
//! `length` is the number of bytes of the body, little endian. `flags` and `stream` are zero in this version. A later
//! version can use them to compress or interleave without another header.

use bytes::{BufMut, Bytes};

use crate::ProtocolError;

#[cfg(feature = "transport")]
mod io;

pub use crate::kind::Kind;
pub(crate) use crate::kind::MAX_HEAD_BYTES;
#[cfg(feature = "transport")]
pub(crate) use io::read_body_counted;
#[cfg(feature = "transport")]
pub use io::{read_body, read_header};

/// Number of bytes of a header.
pub const HEADER_BYTES: usize = 8;

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
