//! A lease with its prediction and deadline.

use std::time::Duration;

use super::Lease;

/// A lease that a worker holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct ActiveLease {
    pub(super) lease: Lease,
    pub(super) granted_at: Duration,
    /// Predicted work of the rows, in rows of average cost.
    pub(super) work: f64,
    /// Tile bands that the rows cover, at least in part.
    pub(super) bands: u32,
    /// Predicted arrival of the pixels; `None` before the worker's speed is measured.
    pub(super) expected_at: Option<Duration>,
    /// Time at which the lease is overdue and its rows go back to the queue.
    pub(super) deadline: Option<Duration>,
    /// Whether it is a second rendering, of rows that are in their picture already.
    pub(super) verifies: bool,
}

impl ActiveLease {
    /// The overrun factor, actual / predicted time, of a lease finished at `now` by a worker that was busy with earlier
    /// leases until `busy_until`. `None` without a prediction.
    pub(super) fn overrun(&self, now: Duration, busy_until: Duration) -> Option<f64> {
        let begun = self.granted_at.max(busy_until);
        let predicted = self.expected_at?.checked_sub(begun)?.as_secs_f64();
        (predicted > 0.0).then(|| now.saturating_sub(begun).as_secs_f64() / predicted)
    }
}
