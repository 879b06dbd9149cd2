//! Control commands of clients, at a bounded rate.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::json;

use super::access::Level;

/// Executes one line and returns its reply, one line of JSON.
pub(crate) type CommandExecutor = Arc<dyn Fn(&str) -> String + Send + Sync>;

/// Largest command, in bytes: that of the other places for commands.
pub(super) const MAX_COMMAND_BYTES: usize = 1024;
/// Commands that all clients together may send at once.
const BURST: u32 = 32;
/// Time after which one more is accepted.
const INTERVAL: Duration = Duration::from_millis(50);

/// The commands of one server.
pub(super) struct Commands {
    execute: CommandExecutor,
    budget: Mutex<Budget>,
}

/// A reply, by whether the command was executed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Reply {
    /// The reply of the executor.
    Executed(String),
    /// The sender may not send the command.
    Forbidden(String),
    /// Too many commands.
    Busy(String),
}

impl Commands {
    /// Commands for this executor.
    pub(super) fn new(execute: CommandExecutor) -> Self {
        Self { execute, budget: Mutex::new(Budget { left: BURST, refilled: Instant::now() }) }
    }

    /// [`Self::reply`] on another thread, because an edit waits until its scene is loaded.
    pub(super) async fn reply_of(self: &Arc<Self>, line: &str, level: Level) -> Reply {
        let (commands, line) = (Arc::clone(self), line.to_owned());
        let replied = tokio::task::spawn_blocking(move || commands.reply(&line, level)).await;
        // A panic has been reported.
        let failed = json!({ "ok": false, "error": "the command has failed" });
        replied.unwrap_or_else(|_| Reply::Executed(failed.to_string()))
    }

    /// Executes a command of a client, if it may send it and there are not too many.
    pub(super) fn reply(&self, line: &str, level: Level) -> Reply {
        let line = line.trim();
        let refused = |error: &str| json!({ "ok": false, "error": error }).to_string();
        if !level.allows(line) {
            return Reply::Forbidden(refused(
                "this command needs the token: open the address that the master's log names",
            ));
        }
        let mut budget = self.budget.lock().unwrap_or_else(PoisonError::into_inner);
        if !budget.take(Instant::now()) {
            return Reply::Busy(refused(&format!(
                "too many commands: {BURST} at once and {} a second are executed; try again",
                1000 / INTERVAL.as_millis()
            )));
        }
        drop(budget);
        Reply::Executed((self.execute)(line).trim_end().to_owned())
    }
}

impl Reply {
    /// The line of JSON.
    pub(super) fn into_line(self) -> String {
        match self {
            Self::Executed(line) | Self::Forbidden(line) | Self::Busy(line) => line,
        }
    }
}

/// Commands that are accepted now.
#[derive(Debug)]
struct Budget {
    left: u32,
    refilled: Instant,
}

impl Budget {
    fn take(&mut self, now: Instant) -> bool {
        let intervals = now.saturating_duration_since(self.refilled).as_nanos() / INTERVAL.as_nanos();
        let more = u32::try_from(intervals).unwrap_or(u32::MAX);
        self.left = self.left.saturating_add(more).min(BURST);
        if self.left == BURST {
            self.refilled = now;
        } else {
            self.refilled += INTERVAL * more;
        }
        let is_left = self.left > 0;
        self.left = self.left.saturating_sub(1);
        is_left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_have_a_budget() {
        let now = Instant::now();
        let mut budget = Budget { left: BURST, refilled: now };
        let taken = (0..100).filter(|_| budget.take(now)).count();
        assert_eq!(taken, BURST as usize);
        assert!(!budget.take(now + INTERVAL / 2));
        let later = now + INTERVAL * 3;
        assert_eq!((0..100).filter(|_| budget.take(later)).count(), 3);
        let much_later = now + INTERVAL * 1_000_000;
        assert_eq!((0..100).filter(|_| budget.take(much_later)).count(), BURST as usize);
    }

    #[test]
    fn only_owners_command_workers() {
        let commands = Commands::new(Arc::new(|line| format!("{{\"ok\":true,\"line\":\"{line}\"}}\n")));
        let forbidden = commands.reply("kick 1", Level::Guest);
        assert!(matches!(&forbidden, Reply::Forbidden(line) if line.contains("token")), "{forbidden:?}");
        let executed = Reply::Executed("{\"ok\":true,\"line\":\"kick 1\"}".to_owned());
        assert_eq!(commands.reply(" kick 1\n", Level::Owner), executed);
        let replies: Vec<Reply> = (0..100).map(|_| commands.reply("status", Level::Guest)).collect();
        let last = replies.last().unwrap();
        assert!(matches!(last, Reply::Busy(line) if line.contains("\"ok\":false")), "{last:?}");
    }
}
