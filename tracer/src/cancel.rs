//! Work that can be cancelled: it asks from time to time whether its result is still wanted.

/// Work was told to stop; it has no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the work was cancelled")]
pub struct Cancelled;

/// Whether work is cancelled: asked by any thread, often. It costs next to nothing, and never says `false` again after `true`.
pub type IsCancelled<'a> = dyn Fn() -> bool + Sync + 'a;

/// Never cancelled.
pub(crate) fn never() -> bool {
    false
}

/// `Ok` while the work is wanted.
pub(crate) fn go_on(cancelled: &IsCancelled<'_>) -> Result<(), Cancelled> {
    if cancelled() { Err(Cancelled) } else { Ok(()) }
}
