//! Names of things: assets, frames, leases.

use std::fmt;
use std::ops::Range;

use serde::{Deserialize, Serialize};

/// The name of an immutable blob: BLAKE3 of its bytes. The scene body and every compiled mesh is an asset.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct AssetId(pub [u8; 32]);

impl AssetId {
    /// The name of these bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self(blake3::hash(bytes).into())
    }
}

impl fmt::Display for AssetId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for AssetId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Eight digits tell assets apart in a log; the whole name is Display's.
        let [a, b, c, d, ..] = self.0;
        write!(f, "AssetId({a:02x}{b:02x}{c:02x}{d:02x})")
    }
}

/// One picture of a run of the master. Later frames have greater numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct FrameId(pub u64);

impl fmt::Display for FrameId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// One worker's promise of one segment: these rows of this frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Lease {
    /// The picture.
    pub frame: FrameId,
    /// The segment within the frame.
    pub segment: u32,
    /// How often the segment had been leased before: a late answer to an older lease is told from the right one.
    pub attempt: u32,
    /// The first row, counted from the top.
    pub first_row: u32,
    /// How many rows; never 0 on the wire.
    pub row_count: u32,
}

impl Lease {
    /// The rows, or `None` where they run past the last number there is or are none.
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
