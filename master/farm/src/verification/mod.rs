//! Segments that are rendered twice: their digests, the arbiter of mismatches, and the frames that have rows of banned
//! workers.

pub(crate) mod arbiter;
pub(crate) mod delivered;
pub(crate) mod open_segments;
