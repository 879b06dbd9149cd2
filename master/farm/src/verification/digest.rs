//! Digests of segments.

/// A hash of the RGB8 rows of a segment: equal digests mean equal pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SegmentDigest(blake3::Hash);

impl SegmentDigest {
    /// The digest of RGB8 rows without gaps.
    pub(crate) fn of(rows: &[u8]) -> Self {
        Self(blake3::hash(rows))
    }
}
