//! Token bucket: a number of events at once, and a rate at which it fills again.

use std::time::Instant;

/// A token bucket.
#[derive(Debug)]
pub(crate) struct Bucket {
    most: f64,
    per_second: f64,
    left: f64,
    at: Instant,
}

impl Bucket {
    /// A full bucket: `most` events at once, `per_second` in the long run.
    pub(crate) fn new((most, per_second): (f64, f64), at: Instant) -> Self {
        Self { most, per_second, left: most, at }
    }

    /// Takes a token. `None`: the bucket is empty.
    pub(crate) fn take(&mut self, now: Instant) -> Option<()> {
        let filled = now.duration_since(self.at).as_secs_f64() * self.per_second;
        self.left = (self.left + filled).min(self.most);
        self.at = now;
        if self.left < 1.0 {
            return None;
        }
        self.left -= 1.0;
        Some(())
    }
}
