//! Cancellation of background work whose result is no longer needed.

use std::sync::{Arc, Weak};

/// Interest in the result of background work. The work is cancelled when the guard is dropped.
#[derive(Debug, Default)]
pub(crate) struct CancelGuard(Arc<()>);

/// The work's side of a [`CancelGuard`]. The work polls it between steps.
#[derive(Clone, Debug)]
pub(crate) struct CancelFlag(Weak<()>);

impl CancelGuard {
    /// Makes a flag for the work that yields the result.
    pub(crate) fn flag(&self) -> CancelFlag {
        CancelFlag(Arc::downgrade(&self.0))
    }
}

impl CancelFlag {
    /// Whether the guard was dropped. Costs one relaxed load.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.0.strong_count() == 0
    }
}
