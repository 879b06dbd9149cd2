//! Links: bandwidth, latency, jitter. A connection keeps its messages in order.

use super::SECOND;

/// One direction of a link: messages follow each other.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lane {
    free_at: u64,
}

impl Lane {
    /// When a message that wants to pass at `now` has passed, at `bytes_per_second`.
    pub(crate) fn pass(&mut self, now: u64, bytes: f64, bytes_per_second: f64) -> u64 {
        self.free_at = self.free_at.max(now) + (bytes / bytes_per_second * SECOND as f64) as u64;
        self.free_at
    }
}

/// One direction of a connection: nothing overtakes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Order {
    last_at: u64,
}

impl Order {
    /// When a message arrives that would arrive at `at` if it were alone.
    pub(crate) fn arrive(&mut self, at: u64) -> u64 {
        self.last_at = self.last_at.max(at);
        self.last_at
    }
}

/// Bytes of messages: payload, envelope, and what TCP and Ethernet add to small ones.
pub(crate) mod bytes {
    pub(crate) const ANNOUNCE: f64 = 330.0;
    pub(crate) const CONTROL: f64 = 130.0;
    pub(crate) const PIXELS_HEAD: f64 = 200.0;
    /// Of a gigabit link, 117.5 MB of 125 are payload.
    pub(crate) const PAYLOAD_SHARE: f64 = 0.94;
}
