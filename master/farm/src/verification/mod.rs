//! Verification: segments that are rendered twice, and the arbiter of mismatches.
//!
//! A segment to verify is *open* from its first rendering until the digests of two renderings are compared. Where they
//! differ, the arbiter renders the rows on the master and decides which worker has sent wrong pixels. A majority would not
//! do: several workers can be wrong in the same way, and the master is the reference of all pictures.

pub(crate) mod arbiter;
pub(crate) mod delivered;
mod digest;
mod open_segments;

pub(crate) use digest::SegmentDigest;
pub(crate) use open_segments::{OpenSegment, OpenSegments, Rendering};
