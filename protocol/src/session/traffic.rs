//! Byte counters of a session.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use crate::envelope::{Envelope, Kind};

/// Numbers of bytes of a session's envelopes, headers included. The handshake is not counted.
#[derive(Debug, Default)]
pub struct Traffic {
    sent: AtomicU64,
    received: AtomicU64,
    scene_sent: AtomicU64,
}

impl Traffic {
    /// Number of bytes written.
    pub fn sent_bytes(&self) -> u64 {
        self.sent.load(Relaxed)
    }

    /// Number of bytes read, including those of an envelope that is arriving.
    pub fn received_bytes(&self) -> u64 {
        self.received.load(Relaxed)
    }

    /// Number of bytes written for frame announcements and assets.
    pub fn scene_sent_bytes(&self) -> u64 {
        self.scene_sent.load(Relaxed)
    }

    pub(super) fn count_sent(&self, envelope: &Envelope) {
        let bytes = envelope.wire_bytes() as u64;
        self.sent.fetch_add(bytes, Relaxed);
        if matches!(envelope.kind(), Kind::Frame | Kind::AssetBegin | Kind::AssetChunk) {
            self.scene_sent.fetch_add(bytes, Relaxed);
        }
    }

    pub(super) fn count_received(&self, bytes: usize) {
        self.received.fetch_add(bytes as u64, Relaxed);
    }
}
