//! Identifiers of assets, frames and leases.

use std::fmt;
use std::ops::Range;

use serde::{Deserialize, Serialize};

/// Identifier of an immutable blob (scene body, compiled mesh, texture): the BLAKE3 hash of its bytes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct AssetId(pub [u8; 32]);

impl AssetId {
    /// Hashes the bytes of an asset.
    pub fn of(bytes: &[u8]) -> Self {
        Self(blake3::hash(bytes).into())
    }
}

impl fmt::Display for AssetId {
    /// Writes all 64 hexadecimal digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for AssetId {
    /// Writes the first eight digits, which distinguish assets in a log.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c, d, ..] = self.0;
        write!(f, "AssetId({a:02x}{b:02x}{c:02x}{d:02x})")
    }
}

/// Number of a frame within a run of the master. Later frames have greater numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct FrameId(pub u64);

impl fmt::Display for FrameId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Assignment of one segment of a frame to a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Lease {
    /// Frame of which the lease is a part.
    pub frame: FrameId,
    /// Number of the segment within the frame.
    pub segment: u32,
    /// Number of earlier leases of the segment. It distinguishes a late reply to an earlier lease from the current one.
    pub attempt: u32,
    /// First row, counted from the top.
    pub first_row: u32,
    /// Number of rows, at least 1 on the wire.
    pub row_count: u32,
}

impl Lease {
    /// Range of the rows, or `None` where it is empty or its end exceeds `u32::MAX`.
    pub fn rows(&self) -> Option<Range<u32>> {
        let end = self.first_row.checked_add(self.row_count)?;
        (self.row_count > 0).then_some(self.first_row..end)
    }
}

impl fmt::Display for Lease {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frame, segment, attempt, first_row, row_count } = self;
        write!(f, "frame {frame} segment {segment}.{attempt} (rows {first_row}+{row_count})")
    }
}
