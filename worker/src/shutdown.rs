//! The two ways to end a worker: drain and stop.

use tokio_util::sync::CancellationToken;

/// A handle that ends a worker. Clones end the same worker.
#[derive(Clone, Debug)]
pub struct ShutdownHandle {
    drain: CancellationToken,
    stop: CancellationToken,
}

impl ShutdownHandle {
    /// Makes a handle for a worker that is not to end yet.
    pub fn new() -> Self {
        let stop = CancellationToken::new();
        // A child token: a stop is a drain as well.
        Self { drain: stop.child_token(), stop }
    }

    /// Drains the worker: it accepts no more leases, finishes those that it has, and ends.
    pub fn drain(&self) {
        self.drain.cancel();
    }

    /// Stops the worker at once, with a disconnect.
    pub fn stop(&self) {
        self.stop.cancel();
    }

    /// Whether a drain or a stop was requested.
    pub(crate) fn is_draining(&self) -> bool {
        self.drain.is_cancelled()
    }

    /// Waits for a drain or a stop.
    pub(crate) async fn draining(&self) {
        self.drain.cancelled().await;
    }

    /// Waits for a stop.
    pub(crate) async fn stopped(&self) {
        self.stop.cancelled().await;
    }
}

impl Default for ShutdownHandle {
    fn default() -> Self {
        Self::new()
    }
}
