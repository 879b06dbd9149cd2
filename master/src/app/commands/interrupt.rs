//! Ctrl-C and SIGTERM: the first ends the run in order, the second one at once.

use tokio_util::sync::CancellationToken;

/// A token that the first signal cancels: signals are received from this call on. Must be called inside a runtime.
pub(super) fn cancelled_by_signals() -> CancellationToken {
    let interrupted = CancellationToken::new();
    let token = interrupted.clone();
    let mut signals = Signals::new();
    tokio::spawn(async move {
        signals.next().await;
        token.cancel();
        signals.next().await;
        crate::display::restore_terminal();
        // No orderly end after a second signal: local workers end too, because their standard input is closed.
        std::process::exit(1);
    });
    interrupted
}

/// SIGINT and SIGTERM. Where there is no handler for one of them, the system's default handling ends the process.
#[cfg(unix)]
struct Signals([Option<tokio::signal::unix::Signal>; 2]);

#[cfg(unix)]
impl Signals {
    fn new() -> Self {
        use tokio::signal::unix::{SignalKind, signal};
        Self([SignalKind::interrupt(), SignalKind::terminate()].map(|kind| signal(kind).ok()))
    }

    async fn next(&mut self) {
        let [interrupt, terminate] = &mut self.0;
        tokio::select! {
            () = received(interrupt) => {}
            () = received(terminate) => {}
        }
    }
}

/// Waits for a signal. Never returns where there is no handler.
#[cfg(unix)]
async fn received(signal: &mut Option<tokio::signal::unix::Signal>) {
    let is_received = match signal {
        Some(signal) => signal.recv().await.is_some(),
        None => false,
    };
    if !is_received {
        std::future::pending::<()>().await;
    }
}

/// Ctrl-C.
#[cfg(not(unix))]
struct Signals;

#[cfg(not(unix))]
impl Signals {
    fn new() -> Self {
        Self
    }

    async fn next(&mut self) {
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
    }
}
