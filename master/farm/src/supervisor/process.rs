//! The supervisor of one local worker process.
//!
//! The master holds the other end of the process's standard input. It writes the join line to it, if the farm has one, and nothing else. When the master ends, however
//! it ends, the pipe closes and the worker exits.

use std::process::{ExitStatus, Stdio};
use std::time::{Duration, Instant};

use tokio::io::AsyncWriteExt;
use tokio::process::{Child, Command};
use tokio_util::sync::CancellationToken;

use super::{LocalWorkerCommand, join_line};
use crate::sessions::addresses::Entrance;

/// A worker that exits sooner counts as a failed start.
const MIN_UPTIME: Duration = Duration::from_secs(30);
/// Consecutive failed starts after which a worker is not restarted.
const MAX_FAILED_STARTS: u32 = 5;
/// Delay before the first restart; each failed start doubles it.
const FIRST_RESTART_DELAY: Duration = Duration::from_millis(500);
/// Time limit for a worker to exit after its standard input is closed.
const EXIT_TIMEOUT: Duration = Duration::from_secs(3);

/// Keeps one worker process running.
pub(super) struct Supervisor {
    pub(super) number: u32,
    /// The name that the worker sends in its handshake: its ticket, where there are tickets.
    pub(super) name: String,
    pub(super) command: LocalWorkerCommand,
    pub(super) entrance: Entrance,
}

impl Supervisor {
    /// Runs the worker, and restarts it when it fails. Returns why it is not restarted any more; `None` after `stop`.
    pub(super) async fn run(&self, stop: &CancellationToken) -> Option<String> {
        let mut failed_starts = 0;
        loop {
            let started = Instant::now();
            let failure = match self.spawn() {
                Ok(mut child) => {
                    // `Child::wait` closes the standard input, which would end the worker: keep it open here.
                    let mut stdin = child.stdin.take();
                    if let Some((stdin, line)) = stdin.as_mut().zip(join_line(&self.entrance)) {
                        // A process that ends before it reads reports its failure itself.
                        let _ = stdin.write_all(format!("{line}\n").as_bytes()).await;
                    }
                    tokio::select! {
                        biased;
                        () = stop.cancelled() => {
                            drop(stdin);
                            end(&mut child, self.number).await;
                            return None;
                        }
                        status = child.wait() => {
                            if status.as_ref().is_ok_and(ExitStatus::success) {
                                // It was drained, banned, or stopped by hand.
                                return Some(format!("local worker {} has left in order", self.number));
                            }
                            described(status)
                        }
                    }
                }
                Err(error) => format!("cannot be started from {}: {error}", self.command.program.display()),
            };
            let number = self.number;
            failed_starts = if started.elapsed() < MIN_UPTIME { failed_starts + 1 } else { 1 };
            if failed_starts >= MAX_FAILED_STARTS {
                let reason = format!("local worker {number} {failure}, {failed_starts} times in a row");
                tracing::error!("{reason}; it is not restarted");
                return Some(reason);
            }
            let delay = FIRST_RESTART_DELAY * (1 << (failed_starts - 1));
            tracing::warn!("local worker {number} {failure}; restarting it in {} ms", delay.as_millis());
            tokio::select! {
                () = stop.cancelled() => return None,
                () = tokio::time::sleep(delay) => {}
            }
        }
    }

    fn spawn(&self) -> std::io::Result<Child> {
        let LocalWorkerCommand { program, args, name_variable } = &self.command;
        let mut command = Command::new(program);
        command.args(args).env(name_variable, &self.name);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).kill_on_drop(true);
        // The terminal sends Ctrl-C to the master's process group only: the master disconnects its workers in order.
        #[cfg(unix)]
        command.process_group(0);
        command.spawn()
    }
}

/// Waits for a worker to exit, and kills it after [`EXIT_TIMEOUT`].
async fn end(child: &mut Child, number: u32) {
    if tokio::time::timeout(EXIT_TIMEOUT, child.wait()).await.is_err() {
        tracing::warn!(
            "local worker {number} does not end within {} s and is killed",
            EXIT_TIMEOUT.as_secs()
        );
        // Killing fails only for a process that has exited meanwhile.
        let _ = child.kill().await;
    }
}

fn described(status: std::io::Result<ExitStatus>) -> String {
    match status {
        Ok(status) => format!("ended ({status})"),
        Err(error) => format!("cannot be waited for: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use std::ffi::OsString;

    use rayfarm_protocol::transport::MasterSecurity;
    use tokio_util::task::TaskTracker;

    use super::*;
    use crate::sessions::identity::local_name;

    fn supervisor(program: &str, args: Vec<OsString>) -> Supervisor {
        let command = LocalWorkerCommand { program: program.into(), args, name_variable: "NAME".to_owned() };
        let entrance = Entrance { address: ([127, 0, 0, 1], 9).into(), security: MasterSecurity::Plain };
        Supervisor { number: 1, name: local_name(1), command, entrance }
    }

    #[tokio::test]
    async fn a_worker_that_cannot_start_is_reported_with_the_reason() {
        let supervisor = supervisor("/nonexistent/worker", Vec::new());
        tokio::time::pause();
        let reason = supervisor.run(&CancellationToken::new()).await.unwrap();
        assert!(reason.contains("/nonexistent/worker") && reason.contains("5 times"), "{reason}");
    }

    #[cfg(unix)]
    #[tokio::test]
    async fn a_worker_ends_with_its_standard_input() {
        let tasks = TaskTracker::new();
        let stop = CancellationToken::new();
        let folder = tempfile::tempdir().unwrap();
        let ended = folder.path().join("ended");
        let script = format!("cat; touch {}", ended.display());
        let args = ["-c".into(), script.into()].to_vec();
        let shell = supervisor("sh", args);
        let stopped = stop.clone();
        let task = tasks.spawn(async move { shell.run(&stopped).await });
        // Its standard input stays open until the stop.
        tokio::time::sleep(Duration::from_millis(300)).await;
        assert!(!ended.exists());
        stop.cancel();
        assert_eq!(task.await.unwrap(), None);
        assert!(ended.exists());
    }
}
