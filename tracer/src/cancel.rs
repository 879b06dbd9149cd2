//! Cancellation of long work, by polling.

/// Error of cancelled work: it has no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the work was cancelled")]
pub struct Cancelled;

/// Whether work is cancelled. Any thread polls it, often, so a call must be cheap; after `true` it never returns `false`.
pub type IsCancelled<'a> = dyn Fn() -> bool + Sync + 'a;

/// The [`IsCancelled`] of work that is never cancelled.
pub(crate) fn never() -> bool {
    false
}

/// Returns [`Cancelled`] if the work is cancelled.
pub(crate) fn go_on(cancelled: &IsCancelled<'_>) -> Result<(), Cancelled> {
    if cancelled() { Err(Cancelled) } else { Ok(()) }
}
