//! Tokens that give a worker access to one asset of another worker.

use serde::{Deserialize, Serialize};

use crate::{AssetId, KeyHash};

/// Secret of one generation of a session between a master and a worker, from which the tokens of the worker's assets are
/// computed.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShareKey(pub [u8; 32]);

/// Proof that the master allows the transfer of one asset from one worker to another.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Token(pub [u8; 32]);

impl Token {
    /// Computes the token of an asset at the worker with this key, for the worker that requests it.
    ///
    /// The token is the keyed BLAKE3 hash of 72 bytes: id of the asset, hash of the requesting worker's public key (zeros
    /// where connections are plain), generation of the key (little endian).
    pub fn new(key: &ShareKey, id: AssetId, requester: Option<KeyHash>, generation: u64) -> Self {
        let mut hasher = blake3::Hasher::new_keyed(&key.0);
        hasher.update(&id.0).update(&requester.map_or([0; 32], |hash| hash.0));
        Self(hasher.update(&generation.to_le_bytes()).finalize().into())
    }
}

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
    /// Compares in constant time.
    fn eq(&self, other: &Self) -> bool {
        blake3::Hash::from(self.0) == blake3::Hash::from(other.0)
    }
}

impl Eq for Token {}
