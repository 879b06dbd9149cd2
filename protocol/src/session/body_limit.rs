//! Bound of the pixels that a session accepts now: what its leases can need.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::kind::MAX_HEAD_BYTES;

/// Largest body of a message with pixels, in bytes. It is checked before memory is allocated, and the user of the session raises it
/// with each lease: a peer without leases may announce no pixels.
#[derive(Clone, Debug)]
pub struct BodyLimit(Arc<AtomicUsize>);

impl BodyLimit {
    /// A limit below which no pixels are accepted until [`Self::allow`].
    pub fn closed() -> Self {
        Self(Arc::new(AtomicUsize::new(0)))
    }

    /// No limit but that of the message type.
    pub(crate) fn unlimited() -> Self {
        Self(Arc::new(AtomicUsize::new(usize::MAX)))
    }

    /// Accepts bodies with pixels of this size from now on. It never falls within a session: replies to older leases may be on the wire.
    pub fn allow(&self, pixel_bytes: usize) {
        self.0.fetch_max(pixel_bytes.saturating_add(MAX_HEAD_BYTES), Ordering::Relaxed);
    }

    pub(super) fn bytes(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }
}
