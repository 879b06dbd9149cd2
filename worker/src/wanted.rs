//! Whether the result of work under way is still wanted.

use std::sync::{Arc, Weak};

/// Held by what waits for a result. When it is dropped, the result is not wanted any more.
#[derive(Debug, Default)]
pub(crate) struct Claim(Arc<()>);

/// Goes with the work, which asks it from time to time.
#[derive(Clone, Debug)]
pub(crate) struct Wanted(Weak<()>);

impl Claim {
    /// For the work that is to yield the result.
    pub(crate) fn wanted(&self) -> Wanted {
        Wanted(Arc::downgrade(&self.0))
    }
}

impl Wanted {
    /// The opposite, for work that may be cancelled: one relaxed load.
    pub(crate) fn is_dropped(&self) -> bool {
        self.0.strong_count() == 0
    }
}
