//! Bounds of the pixels that a session accepts now: what its leases can need, and the room that all sessions share.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tokio::sync::OwnedSemaphorePermit;

use super::ReceiveRoom;
use crate::kind::MAX_HEAD_BYTES;

/// Bounds of a message with pixels. They are checked before memory is allocated, and the user of the session sets the largest size with
/// each lease and each reply: a peer without leases may announce no pixels. Clones share the size.
#[derive(Clone, Debug)]
pub struct BodyLimit {
    /// Largest body, in bytes.
    largest: Arc<AtomicUsize>,
    room: Option<ReceiveRoom>,
}

impl BodyLimit {
    /// A limit that accepts no pixels until [`Self::set`], with the room of all sessions.
    pub fn closed(room: ReceiveRoom) -> Self {
        Self { largest: Arc::default(), room: Some(room) }
    }

    /// No limit but that of the message type.
    pub(crate) fn unlimited() -> Self {
        Self { largest: Arc::new(AtomicUsize::new(usize::MAX)), room: None }
    }

    /// Accepts pixels of at most this number of bytes from now on; `None` accepts none. Where the peer may still reply to an older lease,
    /// the size must include it.
    pub fn set(&self, pixel_bytes: Option<usize>) {
        let largest = pixel_bytes.map_or(0, |bytes| bytes.saturating_add(MAX_HEAD_BYTES));
        self.largest.store(largest, Ordering::Relaxed);
    }

    pub(super) fn bytes(&self) -> usize {
        self.largest.load(Ordering::Relaxed)
    }

    /// Takes a body's share of the room of all sessions, and waits for it. Cancel safe.
    pub(super) async fn enter(&self, body_bytes: usize) -> Option<OwnedSemaphorePermit> {
        match &self.room {
            Some(room) => room.enter(body_bytes).await,
            None => None,
        }
    }

    /// Waits until a body has to end because it is late and other sessions wait. Returns the time limit.
    pub(super) async fn late(&self, body_bytes: usize) -> Duration {
        match &self.room {
            Some(room) => room.late(body_bytes).await,
            None => std::future::pending().await,
        }
    }
}
