//! Ctrl-C and SIGTERM: the first ends the run in order, the second one at once.

use tokio_util::sync::CancellationToken;

/// A token that the first signal cancels. Must be called inside a runtime.
pub(super) fn cancelled_by_signals() -> CancellationToken {
    let interrupted = CancellationToken::new();
    let token = interrupted.clone();
    tokio::spawn(async move {
        signal().await;
        token.cancel();
        signal().await;
        crate::display::restore_terminal();
        // No orderly end after a second signal: local workers end too, because their standard input is closed.
        std::process::exit(1);
    });
    interrupted
}

#[cfg(unix)]
async fn signal() {
    use tokio::signal::unix::{SignalKind, signal};
    let Ok(mut terminate) = signal(SignalKind::terminate()) else {
        return interrupt().await;
    };
    tokio::select! {
        () = interrupt() => {}
        _ = terminate.recv() => {}
    }
}

#[cfg(not(unix))]
async fn signal() {
    interrupt().await;
}

/// Waits for Ctrl-C. Never returns where there is no handler, because the system's default handling then ends the process.
async fn interrupt() {
    if tokio::signal::ctrl_c().await.is_err() {
        std::future::pending::<()>().await;
    }
}
