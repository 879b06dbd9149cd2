//! Progress of the threads that work for a master. A pong reports it, so that a slow worker differs from a stuck one.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Flag that threads set when they finish a step of their work. Clones share it.
///
/// A step ends wherever work polls its cancellation: after a tile, a batch of rays, a part of the preparation of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct ProgressFlag(Arc<AtomicBool>);

impl ProgressFlag {
    /// Notes a finished step. Costs one relaxed load where the flag is set already.
    pub(crate) fn note(&self) {
        if !self.0.load(Ordering::Relaxed) {
            self.0.store(true, Ordering::Relaxed);
        }
    }

    /// Whether a step was noted since the last call.
    pub(crate) fn take(&self) -> bool {
        self.0.swap(false, Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_report_counts_the_steps_since_the_previous_one() {
        let flag = ProgressFlag::default();
        let thread = flag.clone();
        assert!(!flag.take());
        thread.note();
        thread.note();
        assert_eq!([flag.take(), flag.take()], [true, false]);
        thread.note();
        assert!(flag.take());
    }
}
