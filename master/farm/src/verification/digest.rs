//! Digests of segments, computed outside of locks.

use std::fmt;
use std::ops::Deref;
use std::sync::{Arc, LazyLock};

type Compute = Box<dyn FnOnce() -> blake3::Hash + Send>;

/// A hash of the decoded rows of a segment: equal digests mean equal pixels.
///
/// It is computed at its first use, so that it can be created under a lock and computed outside of it. The rows are
/// released then. Clones share the result.
#[derive(Clone)]
pub(crate) struct SegmentDigest(Arc<LazyLock<blake3::Hash, Compute>>);

impl SegmentDigest {
    /// The digest of rows without gaps.
    pub(crate) fn of(rows: impl Deref<Target = [u8]> + Send + 'static) -> Self {
        Self(Arc::new(LazyLock::new(Box::new(move || blake3::hash(&rows)))))
    }

    /// Computes the digest, unless it is computed already. Do not call it under a lock.
    pub(crate) fn compute(&self) {
        LazyLock::force(&self.0);
    }
}

/// Computes both digests, unless they are computed already.
impl PartialEq for SegmentDigest {
    fn eq(&self, other: &Self) -> bool {
        **self.0 == **other.0
    }
}

impl Eq for SegmentDigest {}

impl fmt::Debug for SegmentDigest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("SegmentDigest").field(&**self.0).finish()
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;

    #[test]
    fn equal_rows_have_equal_digests() {
        assert_eq!(SegmentDigest::of(vec![1, 2, 3]), SegmentDigest::of(Bytes::from_static(&[1, 2, 3])));
        assert_ne!(SegmentDigest::of(vec![1, 2, 3]), SegmentDigest::of(vec![1, 2, 4]));
    }

    #[test]
    fn a_digest_is_computed_at_its_first_use_and_releases_its_rows() {
        let rows = Bytes::from(vec![7; 100]);
        let digest = SegmentDigest::of(rows.clone());
        let shared = digest.clone();
        assert!(!rows.is_unique());
        digest.compute();
        assert!(rows.is_unique());
        assert_eq!(shared, SegmentDigest::of(rows));
    }
}
