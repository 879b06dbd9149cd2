//! What a worker reports while it has no master: one line for each change of state, not one for each attempt.

use crate::error::WorkerError;

/// Why a worker has no master now.
#[derive(Debug)]
pub(crate) enum Absence {
    /// The master ended in order, for this reason.
    Ended(String),
    /// A failure that may pass.
    Failed(WorkerError),
}

/// The states that are worth a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// No process listens there.
    Absent,
    /// The address has no meaning on this machine now.
    Unresolved,
    /// A process listens there and does not take this worker now.
    Unfit,
}

/// What was logged since the last session.
#[derive(Debug, Default)]
pub(crate) struct Waiting {
    logged: Option<State>,
}

impl Waiting {
    /// A session has begun: the next absence is a new one.
    pub(crate) fn over(&mut self) {
        self.logged = None;
    }

    /// Logs why there is no master, if the log does not say so already.
    pub(crate) fn log(&mut self, master: &str, absence: &Absence) {
        let is_new = self.changes(absence);
        match absence {
            Absence::Ended(reason) if is_new => {
                tracing::info!(
                    "the master at {master} says goodbye: {reason}; waiting for the next one (Ctrl-C ends this worker)"
                );
            }
            Absence::Failed(error) if is_new => {
                tracing::warn!("{error}; waiting for it, Ctrl-C ends this worker");
            }
            absence => tracing::debug!("still waiting: {absence:?}"),
        }
    }

    fn changes(&mut self, absence: &Absence) -> bool {
        let state = match absence {
            Absence::Failed(WorkerError::Resolve { .. }) => State::Unresolved,
            Absence::Failed(WorkerError::Handshake { .. }) => State::Unfit,
            Absence::Ended(_) | Absence::Failed(_) => State::Absent,
        };
        self.logged.replace(state) != Some(state)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Error, ErrorKind};

    use super::*;

    fn refused() -> Absence {
        let source = Error::from(ErrorKind::ConnectionRefused);
        Absence::Failed(WorkerError::Connect { master: "farm:1".into(), source })
    }

    fn unknown() -> Absence {
        let source = Error::from(ErrorKind::NotFound);
        Absence::Failed(WorkerError::Resolve { master: "farm:1".into(), source })
    }

    #[test]
    fn a_line_for_each_change_and_none_for_each_attempt() {
        let mut waiting = Waiting::default();
        let ended = Absence::Ended("the master ends".into());
        assert!(waiting.changes(&ended));
        assert!((0..5).all(|_| !waiting.changes(&refused())));
        assert!(waiting.changes(&unknown()) && !waiting.changes(&unknown()));
        assert!(waiting.changes(&refused()));
        waiting.over();
        assert!(waiting.changes(&refused()));
    }
}
