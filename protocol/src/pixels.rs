//! The head of a rendered segment: 64 bytes, then the pixels.
//!
//! ```text
//! 0       8         12        16          20          24         28     32         40        48       56
//! | frame | segment | attempt | first_row | row_count | encoding | zero | trace_ns | primary | shadow | secondary |
//! ```

use bytes::{Buf, BufMut};

use crate::envelope::Kind;
use crate::ids::{FrameId, Lease};
use crate::{ProtocolError, limits};

/// Bytes of [`PixelsHeader`] on the wire.
pub(crate) const PIXELS_HEAD_BYTES: usize = 64;

/// How the pixels of a segment are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// RGB8, sRGB, rows from top to bottom without gaps.
    Raw,
}

/// What a segment cost the worker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Nanoseconds of tracing, summed over the render threads.
    pub trace_ns: u64,
    /// Primary rays.
    pub primary: u64,
    /// Shadow rays.
    pub shadow: u64,
    /// Rays of reflection and transmission.
    pub secondary: u64,
}

/// What a run of pixels is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelsHeader {
    /// The promise that this fulfils.
    pub lease: Lease,
    /// How the bytes are to be read.
    pub encoding: Encoding,
    /// What it cost.
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
        rest.put_u32_le(match encoding {
            Encoding::Raw => 0,
        });
        rest.put_u32_le(0);
        rest.put_u64_le(cost.trace_ns);
        rest.put_u64_le(cost.primary);
        rest.put_u64_le(cost.shadow);
        rest.put_u64_le(cost.secondary);
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
        let encoding = match (rest.get_u32_le(), rest.get_u32_le()) {
            (0, 0) => Encoding::Raw,
            (other, _) => {
                return Err(ProtocolError::malformed(Kind::Pixels, format!("encoding {other} is not known")));
            }
        };
        let cost = Cost {
            trace_ns: rest.get_u64_le(),
            primary: rest.get_u64_le(),
            shadow: rest.get_u64_le(),
            secondary: rest.get_u64_le(),
        };
        Ok(Self { lease, encoding, cost })
    }
}

/// Bytes of `row_count` raw rows of a frame `width` pixels wide, or `None` where one envelope cannot carry them.
pub fn raw_bytes(width: u32, row_count: u32) -> Option<usize> {
    let pixels = (width as usize).checked_mul(row_count as usize)?;
    pixels.checked_mul(3).filter(|bytes| *bytes <= limits::MAX_PIXELS_BYTES)
}
