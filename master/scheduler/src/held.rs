//! A lease as its worker holds it.

use std::time::Duration;

use super::Lease;

/// A promise of rows, as kept by the scheduler.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub(super) lease: Lease,
    pub(super) granted_at: Duration,
    /// Predicted work of the rows, see `cost_map`.
    pub(super) work: f64,
    /// Bands of tiles that the rows are.
    pub(super) bands: u32,
    /// When the pixels should be here; `None` while nothing is known of the worker's speed.
    pub(super) expected_at: Option<Duration>,
    /// When they are so late that others are given the rows.
    pub(super) deadline: Option<Duration>,
    /// Whether the rows are in their picture already, and are verified.
    pub(super) audit: bool,
}

impl Held {
    /// By what factor it took longer than predicted, done at `now` by a worker that was busy until `busy_until`.
    pub(super) fn surprise(&self, now: Duration, busy_until: Duration) -> Option<f64> {
        let begun = self.granted_at.max(busy_until);
        let predicted = self.expected_at?.checked_sub(begun)?.as_secs_f64();
        (predicted > 0.0).then(|| now.saturating_sub(begun).as_secs_f64() / predicted)
    }
}
