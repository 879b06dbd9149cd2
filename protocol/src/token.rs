//! Tokens that give a worker access to one asset of another worker.

use serde::{Deserialize, Serialize};

use crate::AssetId;

/// Secret of one session between a master and a worker, from which the tokens of the worker's assets are computed.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShareKey(pub [u8; 32]);

/// Proof that the master allows the transfer of one asset from one worker.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Token(pub [u8; 32]);

impl Token {
    /// Computes the token of an asset at the worker with this key: the keyed BLAKE3 hash of the asset's id.
    pub fn new(key: &ShareKey, id: AssetId) -> Self {
        Self(blake3::keyed_hash(&key.0, &id.0).into())
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
