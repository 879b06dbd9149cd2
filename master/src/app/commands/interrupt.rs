//! Ctrl-C and SIGTERM: the first ends the run in order, the second at once.

use tokio_util::sync::CancellationToken;

/// Listens from now on; the token is cancelled by the first signal. Call it inside a runtime.
pub(super) fn cancelled_by_signals() -> CancellationToken {
    let interrupted = CancellationToken::new();
    let token = interrupted.clone();
    tokio::spawn(async move {
        signal().await;
        token.cancel();
        signal().await;
        // Whoever asks twice does not want to wait; local workers see their standard input close and end too.
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

/// Waits for Ctrl-C; where it cannot be listened for, for ever: the system's own handling ends the process then.
async fn interrupt() {
    if tokio::signal::ctrl_c().await.is_err() {
        std::future::pending::<()>().await;
    }
}
