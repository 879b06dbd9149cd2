//! A master that a worker may join.

use std::fmt;
use std::sync::Arc;

use rayfarm_protocol::transport::{PrivateKey, WorkerSecurity};

use super::options::WorkerOptions;
use super::trust::{MasterList, RememberedMaster, state_folder};

/// Address and security of a master.
pub(super) struct Target {
    /// Address as HOST:PORT.
    pub(super) master: String,
    /// Whether the worker connects through TLS, with which keys and token.
    pub(super) security: WorkerSecurity,
    /// Entry to save when the worker has joined.
    to_remember: Option<RememberedMaster>,
}

impl Target {
    /// The master of a worker's options.
    pub(super) fn of(options: &WorkerOptions) -> Self {
        Self { master: options.master.clone(), security: options.security.clone(), to_remember: None }
    }

    /// A master without TLS.
    pub(super) fn plain(master: &str) -> Self {
        Self { master: master.to_owned(), security: WorkerSecurity::Plain, to_remember: None }
    }

    /// A master that a worker with this key joins through TLS, and that it remembers where `remember` is true.
    pub(super) fn encrypted(key: &Arc<PrivateKey>, master: RememberedMaster, remember: bool) -> Self {
        Self {
            master: master.line.address.clone(),
            security: WorkerSecurity::join(Arc::clone(key), &master.line),
            to_remember: remember.then_some(master),
        }
    }

    /// Saves the master in the state folder when the worker has joined. A failure is logged once.
    pub(super) fn record_join(&mut self) {
        let Some(master) = self.to_remember.take() else { return };
        let Some(folder) = state_folder() else {
            tracing::warn!("the master is not remembered: the environment names no home folder");
            return;
        };
        let saved = MasterList::load(&folder).and_then(|mut list| list.remember(master));
        if let Err(error) = saved {
            tracing::warn!("the master is not remembered: {error}");
        }
    }
}

impl fmt::Debug for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Target({})", self.master)
    }
}
