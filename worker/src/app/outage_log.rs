//! The log of a worker without a master: one line for each change of state, not one for each attempt.

use std::collections::BTreeMap;

use crate::error::WorkerError;

/// Reason why a worker has no master.
#[derive(Debug)]
pub(super) enum Outage {
    /// The master ended, for this reason.
    MasterEnded(String),
    /// A failure that a later attempt may not have.
    Failed(WorkerError),
}

/// States that have a line each in the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// No process listens at the address.
    Unreachable,
    /// The address does not resolve.
    Unresolved,
    /// A process listens at the address and does not accept this worker now.
    Rejected,
}

/// Record of the last state of each master that was logged since the last session.
#[derive(Debug, Default)]
pub(super) struct OutageLog {
    logged: BTreeMap<String, State>,
}

impl OutageLog {
    /// Ends the outage: a session has begun.
    pub(super) fn end(&mut self) {
        self.logged.clear();
    }

    /// Logs an outage, unless its state is the last one that was logged.
    pub(super) fn log(&mut self, master: &str, outage: &Outage) {
        let is_new = self.update(master, outage);
        match outage {
            Outage::MasterEnded(reason) if is_new => {
                tracing::info!(
                    "the master at {master} ended: {reason}; waiting for the next master (Ctrl-C ends this worker)"
                );
            }
            Outage::Failed(error) if is_new => {
                tracing::warn!("{error}; retrying (Ctrl-C ends this worker)");
            }
            outage => tracing::debug!("retrying: {outage:?}"),
        }
    }

    /// Records the state of an outage. Returns whether it is a new one.
    fn update(&mut self, master: &str, outage: &Outage) -> bool {
        let state = match outage {
            Outage::Failed(WorkerError::Resolve { .. }) => State::Unresolved,
            Outage::Failed(WorkerError::Handshake { .. }) => State::Rejected,
            Outage::MasterEnded(_) | Outage::Failed(_) => State::Unreachable,
        };
        self.logged.insert(master.to_owned(), state) != Some(state)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Error, ErrorKind};

    use super::*;

    fn refused() -> Outage {
        let source = Error::from(ErrorKind::ConnectionRefused);
        Outage::Failed(WorkerError::Connect { master: "farm:1".into(), source })
    }

    fn unresolved() -> Outage {
        let source = Error::from(ErrorKind::NotFound);
        Outage::Failed(WorkerError::Resolve { master: "farm:1".into(), source })
    }

    #[test]
    fn each_change_of_state_is_logged_once() {
        let mut log = OutageLog::default();
        let ended = Outage::MasterEnded("end of the run".into());
        assert!(log.update("farm:1", &ended));
        assert!((0..5).all(|_| !log.update("farm:1", &refused())));
        assert!(log.update("farm:1", &unresolved()) && !log.update("farm:1", &unresolved()));
        assert!(log.update("farm:1", &refused()));
        // Another master has a state of its own.
        assert!(log.update("farm:2", &unresolved()));
        assert!(!log.update("farm:1", &refused()) && !log.update("farm:2", &unresolved()));
        log.end();
        assert!(log.update("farm:1", &refused()));
    }
}
