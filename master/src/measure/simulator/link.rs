//! Links with bandwidth, and connections that keep messages in order.

use super::clock::SECOND;

/// One direction of a link; it carries one message at a time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lane {
    free_at: u64,
}

impl Lane {
    /// Time, in nanoseconds, at which a message that is sent at `now` has passed the link, at `bytes_per_second`.
    pub(crate) fn pass(&mut self, now: u64, bytes: f64, bytes_per_second: f64) -> u64 {
        self.free_at = self.free_at.max(now) + (bytes / bytes_per_second * SECOND as f64) as u64;
        self.free_at
    }
}

/// One direction of a connection: messages arrive in the order in which they were sent.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Order {
    last_at: u64,
}

impl Order {
    /// Time, in nanoseconds, at which a message arrives that would arrive at `at` if it were alone.
    pub(crate) fn arrive(&mut self, at: u64) -> u64 {
        self.last_at = self.last_at.max(at);
        self.last_at
    }
}

/// Sizes of messages in bytes: payload, envelope, and the overhead of TCP and Ethernet for small ones.
pub(crate) mod bytes {
    pub(crate) const ANNOUNCE: f64 = 330.0;
    pub(crate) const CONTROL: f64 = 130.0;
    pub(crate) const PIXELS_HEAD: f64 = 200.0;
    /// 117.5 MB of the 125 MB per second of a gigabit link are payload.
    pub(crate) const PAYLOAD_SHARE: f64 = 0.94;
}
