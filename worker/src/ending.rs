//! The two ways in which a worker is told to end.

use tokio_util::sync::CancellationToken;

/// Ends a worker; clones end the same one.
#[derive(Clone, Debug)]
pub struct Ending {
    drain: CancellationToken,
    stop: CancellationToken,
}

impl Ending {
    /// Of a worker that is to go on for now.
    pub fn new() -> Self {
        let stop = CancellationToken::new();
        // Whoever stops has drained, too.
        Self { drain: stop.child_token(), stop }
    }

    /// It takes no more leases, finishes those it holds, and ends.
    pub fn drain(&self) {
        self.drain.cancel();
    }

    /// It ends now, with a goodbye.
    pub fn stop(&self) {
        self.stop.cancel();
    }

    pub(crate) fn is_draining(&self) -> bool {
        self.drain.is_cancelled()
    }

    /// Waits until it is told to end in either way.
    pub(crate) async fn draining(&self) {
        self.drain.cancelled().await;
    }

    pub(crate) async fn stopped(&self) {
        self.stop.cancelled().await;
    }
}

impl Default for Ending {
    fn default() -> Self {
        Self::new()
    }
}
