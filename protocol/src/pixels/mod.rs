//! The head of a rendered segment: 88 bytes, then the pixels.
//!
//! ```text
//! 0       8         12        16          20          24         28     32         40        48          56        64
//! | frame | segment | attempt | first_row | row_count | encoding | zero | trace_ns | wait_ns | encode_ns | span_ns |
//! 64        72       80
//! | primary | shadow | secondary |
//! ```

mod blocks;
mod narrow;

use bytes::{Buf, BufMut};

use crate::envelope::Kind;
use crate::ids::{FrameId, Lease};
use crate::{ProtocolError, limits};

pub use blocks::{BlockError, Packer, unpack};
pub use narrow::{narrow, narrow_bytes, widen};

/// Bytes of [`PixelsHeader`] on the wire.
pub(crate) const PIXELS_HEAD_BYTES: usize = 88;

/// How the pixels of a segment are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// RGB8, sRGB, rows from top to bottom without gaps.
    Raw,
    /// The same in blocks of LZ4: see [`unpack`].
    Lz4,
    /// Two bytes a pixel: see [`narrow`].
    Narrow,
    /// These in blocks of LZ4.
    NarrowLz4,
}

/// What a segment cost the worker. Times are the worker's own: no two clocks are compared.
///
/// From the lease's arrival to the moment its pixels are handed to the session it takes `wait_ns + span_ns`; what the
/// master waits beyond that went into the wire and its queues.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Nanoseconds of tracing, summed over the render threads.
    pub trace_ns: u64,
    /// From the moment the lease arrived until its first row was begun: earlier leases, the scene on its way.
    pub wait_ns: u64,
    /// Nanoseconds of encoding the pixels, summed over the render threads.
    pub encode_ns: u64,
    /// From the moment its first row was begun until all of it was traced and encoded, by the clock on the wall.
    pub span_ns: u64,
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
            Encoding::Lz4 => 1,
            Encoding::Narrow => 2,
            Encoding::NarrowLz4 => 3,
        });
        rest.put_u32_le(0);
        cost.put(&mut rest);
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
            (1, 0) => Encoding::Lz4,
            (2, 0) => Encoding::Narrow,
            (3, 0) => Encoding::NarrowLz4,
            (other, _) => {
                return Err(ProtocolError::malformed(Kind::Pixels, format!("encoding {other} is not known")));
            }
        };
        Ok(Self { lease, encoding, cost: Cost::get(&mut rest) })
    }
}

impl std::ops::AddAssign for Cost {
    /// What several segments cost together.
    fn add_assign(&mut self, other: Self) {
        let add = |sum: &mut u64, more| *sum = sum.saturating_add(more);
        add(&mut self.trace_ns, other.trace_ns);
        add(&mut self.wait_ns, other.wait_ns);
        add(&mut self.encode_ns, other.encode_ns);
        add(&mut self.span_ns, other.span_ns);
        add(&mut self.primary, other.primary);
        add(&mut self.shadow, other.shadow);
        add(&mut self.secondary, other.secondary);
    }
}

impl Cost {
    fn put(self, to: &mut impl BufMut) {
        let Self { trace_ns, wait_ns, encode_ns, span_ns, primary, shadow, secondary } = self;
        [trace_ns, wait_ns, encode_ns, span_ns, primary, shadow, secondary]
            .into_iter()
            .for_each(|value| to.put_u64_le(value));
    }

    fn get(from: &mut impl Buf) -> Self {
        Self {
            trace_ns: from.get_u64_le(),
            wait_ns: from.get_u64_le(),
            encode_ns: from.get_u64_le(),
            span_ns: from.get_u64_le(),
            primary: from.get_u64_le(),
            shadow: from.get_u64_le(),
            secondary: from.get_u64_le(),
        }
    }
}

/// Bytes of `row_count` raw rows of a frame `width` pixels wide, or `None` where one envelope cannot carry them.
pub fn raw_bytes(width: u32, row_count: u32) -> Option<usize> {
    let pixels = (width as usize).checked_mul(row_count as usize)?;
    pixels.checked_mul(3).filter(|bytes| *bytes <= limits::MAX_PIXELS_BYTES)
}
