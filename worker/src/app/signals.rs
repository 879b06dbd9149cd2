//! Events of the operating system that end a worker: signals, and the end of standard input.

use std::io::Read;

use crate::shutdown::ShutdownHandle;

/// Drains the worker at the first SIGTERM, SIGINT or Ctrl-C, and stops it at the second.
pub(super) async fn shut_down_on_signals(shutdown: ShutdownHandle) {
    if let Err(error) = wait_for_signals(&shutdown).await {
        tracing::warn!("cannot listen for signals: {error}; end this worker through its master");
    }
}

fn drain(shutdown: &ShutdownHandle, signal: &str) {
    tracing::info!("{signal}: ends when all leased segments are done; a second signal ends it at once");
    shutdown.drain();
}

#[cfg(unix)]
async fn wait_for_signals(shutdown: &ShutdownHandle) -> std::io::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    tokio::select! {
        _ = terminate.recv() => drain(shutdown, "terminated"),
        _ = interrupt.recv() => drain(shutdown, "interrupted"),
    }
    tokio::select! {
        _ = terminate.recv() => shutdown.stop(),
        _ = interrupt.recv() => shutdown.stop(),
    }
    Ok(())
}

#[cfg(not(unix))]
async fn wait_for_signals(shutdown: &ShutdownHandle) -> std::io::Result<()> {
    tokio::signal::ctrl_c().await?;
    drain(shutdown, "interrupted");
    tokio::signal::ctrl_c().await?;
    shutdown.stop();
    Ok(())
}

/// Stops the worker at the end of standard input. The parent process has the other end of the pipe, which the system
/// closes at the end of the parent, whatever ends it.
pub(super) fn stop_at_end_of_stdin(shutdown: ShutdownHandle) {
    let wait = move || {
        let mut stdin = std::io::stdin().lock();
        let mut discarded = [0; 256];
        while matches!(stdin.read(&mut discarded), Ok(more) if more > 0) {}
        tracing::debug!("standard input has ended");
        shutdown.stop();
    };
    if let Err(error) = std::thread::Builder::new().name("stdin".to_owned()).spawn(wait) {
        tracing::warn!("cannot watch standard input: {error}");
    }
}
