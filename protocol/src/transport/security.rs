//! Whether an end of a connection uses TLS, and with which keys and tokens.

use std::collections::{BTreeSet, VecDeque};
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::watch;

use super::{JoinLine, JoinToken, PrivateKey};
use crate::KeyHash;

/// Security of the connections that a master accepts.
#[derive(Clone, Debug, Default)]
pub enum MasterSecurity {
    /// No encryption and no proof: every program that reaches the port can join.
    #[default]
    Plain,
    /// TLS 1.3, and only workers that prove the token.
    Tls(Arc<MasterTrust>),
}

/// Most workers that have joined and are not fetched yet by [`MasterTrust::take_joined`]; beyond that, the oldest is dropped.
const MAX_JOINED: usize = 1024;

/// Key of a master, and what can change while the master runs: the token of its farm and the revoked keys of workers.
pub struct MasterTrust {
    key: PrivateKey,
    token: Mutex<JoinToken>,
    revoked: watch::Sender<BTreeSet<KeyHash>>,
    joined: Mutex<VecDeque<JoinedWorker>>,
}

/// A worker that has proved the token.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JoinedWorker {
    /// Hash of its public key.
    pub key: KeyHash,
    /// The name that it sends: any text.
    pub name: String,
}

/// Security of the connection from a worker to its master.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum WorkerSecurity {
    /// No encryption: the worker connects to plain masters only.
    #[default]
    Plain,
    /// TLS 1.3, with one master only.
    Tls {
        /// Key of the worker, which is its identity.
        key: Arc<PrivateKey>,
        /// Hash of the master's public key.
        master: KeyHash,
        /// Token of the farm.
        token: JoinToken,
    },
}

impl MasterSecurity {
    /// Hash of the master's public key, with TLS.
    pub fn key_hash(&self) -> Option<KeyHash> {
        match self {
            Self::Plain => None,
            Self::Tls(trust) => Some(trust.key_hash()),
        }
    }
}

impl MasterTrust {
    /// Joins a key and the farm's first token.
    pub fn new(key: PrivateKey, token: JoinToken) -> Self {
        Self { key, token: Mutex::new(token), revoked: watch::Sender::default(), joined: Mutex::default() }
    }

    /// The master's key.
    pub fn key(&self) -> &PrivateKey {
        &self.key
    }

    /// Hash of the master's public key.
    pub fn key_hash(&self) -> KeyHash {
        self.key.hash()
    }

    /// The token that a worker must prove now.
    pub fn token(&self) -> JoinToken {
        *self.token.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Replaces the token. Sessions continue; later handshakes need the new token.
    pub fn set_token(&self, token: JoinToken) {
        *self.token.lock().unwrap_or_else(PoisonError::into_inner) = token;
    }

    /// Replaces the set of keys whose workers are refused.
    pub fn set_revoked(&self, keys: BTreeSet<KeyHash>) {
        self.revoked.send_replace(keys);
    }

    /// Whether the workers with a key are refused.
    pub fn is_revoked(&self, key: &KeyHash) -> bool {
        self.revoked.borrow().contains(key)
    }

    /// The set of revoked keys, and its changes.
    pub fn revoked(&self) -> watch::Receiver<BTreeSet<KeyHash>> {
        self.revoked.subscribe()
    }

    /// Records that a worker has joined.
    pub fn add_joined(&self, worker: JoinedWorker) {
        let mut joined = self.joined.lock().unwrap_or_else(PoisonError::into_inner);
        if joined.len() >= MAX_JOINED {
            joined.pop_front();
        }
        joined.push_back(worker);
    }

    /// The workers that have joined since the last call, in order.
    pub fn take_joined(&self) -> Vec<JoinedWorker> {
        let mut joined = self.joined.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *joined).into()
    }

    /// The line with which workers join, for an address (HOST:PORT) at which they reach the master.
    pub fn join_line(&self, address: impl Into<String>) -> JoinLine {
        JoinLine { address: address.into(), key: self.key_hash(), token: self.token() }
    }
}

impl fmt::Debug for MasterTrust {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "MasterTrust({:?})", self.key_hash())
    }
}

impl PartialEq for MasterSecurity {
    /// Whether both are plain or have the same key.
    fn eq(&self, other: &Self) -> bool {
        self.key_hash() == other.key_hash()
    }
}

impl Eq for MasterSecurity {}

impl WorkerSecurity {
    /// Security of a worker with this key that joins by this line.
    pub fn join(key: Arc<PrivateKey>, line: &JoinLine) -> Self {
        Self::Tls { key, master: line.key, token: line.token }
    }

    /// Hash of the worker's public key, with TLS.
    pub fn key_hash(&self) -> Option<KeyHash> {
        match self {
            Self::Plain => None,
            Self::Tls { key, .. } => Some(key.hash()),
        }
    }
}
