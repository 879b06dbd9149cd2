//! The head of a rendered segment: 88 bytes in front of the pixels, all numbers little endian.
//!
//! ```text
//! 0       8         12        16          20          24         28     32         40        48          56        64
//! | frame | segment | attempt | first_row | row_count | encoding | zero | trace_ns | wait_ns | encode_ns | span_ns |
//! 64        72       80          88
//! | primary | shadow | secondary |
//! ```

use bytes::{Buf, BufMut};

use crate::envelope::Kind;
use crate::{Cost, FrameId, Lease, ProtocolError};

/// Number of bytes of [`PixelsHeader`] on the wire.
pub(crate) const PIXELS_HEAD_BYTES: usize = 88;

/// Encoding of the pixels of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Rows from top to bottom without gaps, in the [`PixelFormat`](super::PixelFormat) of the frame.
    Raw,
    /// The same bytes in blocks of LZ4: see [`unpack`](super::unpack).
    Lz4,
    /// RGB8 in rows of two bytes per pixel: see [`to_rgb565`](super::to_rgb565).
    Rgb565,
    /// RGB 5-6-5 in blocks of LZ4.
    Rgb565Lz4,
    /// The bytes of each band sorted by their place in the pixel, in blocks of LZ4: see [`unpack_planes`](super::unpack_planes).
    PlanesLz4,
}

impl Encoding {
    /// Number of the encoding on the wire.
    fn code(self) -> u32 {
        match self {
            Self::Raw => 0,
            Self::Lz4 => 1,
            Self::Rgb565 => 2,
            Self::Rgb565Lz4 => 3,
            Self::PlanesLz4 => 4,
        }
    }

    fn from_code(code: u32) -> Option<Self> {
        match code {
            0 => Some(Self::Raw),
            1 => Some(Self::Lz4),
            2 => Some(Self::Rgb565),
            3 => Some(Self::Rgb565Lz4),
            4 => Some(Self::PlanesLz4),
            _ => None,
        }
    }
}

/// Description of the pixels of one segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelsHeader {
    /// The lease that the pixels answer.
    pub lease: Lease,
    /// Encoding of the pixels.
    pub encoding: Encoding,
    /// Time and rays that the segment has taken.
    pub cost: Cost,
}

impl PixelsHeader {
    pub(crate) fn to_bytes(self) -> [u8; PIXELS_HEAD_BYTES] {
        let Self { lease, encoding, cost } = self;
        let mut bytes = [0; PIXELS_HEAD_BYTES];
        let mut rest = bytes.as_mut_slice();
        rest.put_u64_le(lease.frame.0);
        rest.put_u32_le(lease.segment);
        rest.put_u32_le(lease.attempt);
        rest.put_u32_le(lease.first_row);
        rest.put_u32_le(lease.row_count);
        rest.put_u32_le(encoding.code());
        rest.put_u32_le(0);
        put_cost(cost, &mut rest);
        bytes
    }

    pub(crate) fn from_bytes(bytes: [u8; PIXELS_HEAD_BYTES]) -> Result<Self, ProtocolError> {
        let mut rest = bytes.as_slice();
        let lease = Lease {
            frame: FrameId(rest.get_u64_le()),
            segment: rest.get_u32_le(),
            attempt: rest.get_u32_le(),
            first_row: rest.get_u32_le(),
            row_count: rest.get_u32_le(),
        };
        let (code, zero) = (rest.get_u32_le(), rest.get_u32_le());
        let encoding = Encoding::from_code(code).filter(|_| zero == 0);
        let encoding = encoding
            .ok_or_else(|| ProtocolError::malformed(Kind::Pixels, format!("encoding {code} is not known")))?;
        Ok(Self { lease, encoding, cost: get_cost(&mut rest) })
    }
}

/// Writes the seven numbers of a cost, in the order of the fields.
fn put_cost(cost: Cost, to: &mut impl BufMut) {
    let Cost { trace_ns, wait_ns, encode_ns, span_ns, primary, shadow, secondary } = cost;
    [trace_ns, wait_ns, encode_ns, span_ns, primary, shadow, secondary]
        .into_iter()
        .for_each(|value| to.put_u64_le(value));
}

/// Reads what [`put_cost`] has written.
fn get_cost(from: &mut impl Buf) -> Cost {
    Cost {
        trace_ns: from.get_u64_le(),
        wait_ns: from.get_u64_le(),
        encode_ns: from.get_u64_le(),
        span_ns: from.get_u64_le(),
        primary: from.get_u64_le(),
        shadow: from.get_u64_le(),
        secondary: from.get_u64_le(),
    }
}
