//! The priority of the worker's process.

/// Raises the niceness of the process. A failure is logged and changes nothing else.
#[cfg(unix)]
pub(super) fn lower_priority(niceness: u8) {
    match rustix::process::nice(i32::from(niceness)) {
        Ok(reached) => tracing::debug!("the niceness is {reached}"),
        Err(error) => tracing::warn!("--nice {niceness} has no effect: {error}"),
    }
}

/// Reports that this system has no niceness.
#[cfg(not(unix))]
pub(super) fn lower_priority(niceness: u8) {
    tracing::warn!("--nice {niceness} has no effect on this system");
}
