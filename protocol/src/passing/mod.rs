//! Assets from worker to worker, so that the master's link carries a large one once.
//!
//! The master tells a worker where it gets an asset ([`crate::ToWorker::AssetFrom`]): from a worker that has it, or has yet to
//! receive the rest of it. The one connects to the other and asks ([`Fetch`]); the other sends chunks as they come in,
//! and a ping where it has to wait for some itself. Whatever is wrong with it, the master is asked for the rest.
//!
//! ```text
//! Fetch ->            <- AssetBegin, AssetChunk | Ping ...   or AssetUnknown
//! ```
//!
//! A worker gives only what a *token* is shown for, which the master hands out: [`token`] of a key that only the master
//! and this worker know. There is no preamble: the master has seen to it that both are of its own version.

#[cfg(feature = "transport")]
mod io;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::AssetId;

#[cfg(feature = "transport")]
pub use io::{ask, hear, next, pass};

/// What a worker shares with its master alone.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShareKey(pub [u8; 32]);

/// What opens one asset at one worker.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Token(pub [u8; 32]);

impl std::fmt::Debug for ShareKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("ShareKey(..)")
    }
}

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token(..)")
    }
}

impl PartialEq for Token {
    /// Takes the same time wherever the two differ.
    fn eq(&self, other: &Self) -> bool {
        blake3::Hash::from(self.0) == blake3::Hash::from(other.0)
    }
}

impl Eq for Token {}

/// The token of an asset at the worker with this key.
pub fn token(key: &ShareKey, id: AssetId) -> Token {
    Token(blake3::keyed_hash(&key.0, &id.0).into())
}

/// What a worker asks another one for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fetch {
    /// Which asset.
    pub id: AssetId,
    /// What opens it.
    pub token: Token,
    /// From which byte on.
    pub offset: u64,
}

/// What the other one answers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Passed {
    /// It has the asset, or will have it.
    Begin {
        /// All its bytes.
        size: u64,
    },
    /// The next bytes.
    Chunk {
        /// Where in the asset they begin.
        offset: u64,
        /// The bytes.
        bytes: Bytes,
    },
    /// It waits for more itself.
    Waits,
    /// It does not have it, or the token does not open it.
    Unknown,
}
