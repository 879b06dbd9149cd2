//! Bytes on the wire.

use rayfarm_protocol::session::Traffic;

/// Bytes that sessions have sent and received.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ByteCount {
    pub(crate) sent: u64,
    pub(crate) received: u64,
    /// The part of `sent` that describes what to draw: frame announcements and assets.
    pub(crate) scene: u64,
}

impl ByteCount {
    /// Adds what one session has sent and received so far.
    pub(crate) fn add(&mut self, traffic: &Traffic) {
        self.sent = self.sent.saturating_add(traffic.sent_bytes());
        self.received = self.received.saturating_add(traffic.received_bytes());
        self.scene = self.scene.saturating_add(traffic.scene_sent_bytes());
    }

    /// The difference to an earlier count.
    pub(crate) fn since(self, earlier: Self) -> Self {
        Self {
            sent: self.sent.saturating_sub(earlier.sent),
            received: self.received.saturating_sub(earlier.received),
            scene: self.scene.saturating_sub(earlier.scene),
        }
    }
}
