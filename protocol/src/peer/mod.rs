//! Transfer of assets between workers, so that the master's link carries a large asset once.
//!
//! The master sends a worker the address of another worker that has the asset or is still receiving it
//! ([`crate::ToWorker::AssetFrom`]). The first worker connects to the second and sends a [`PeerRequest`]. The second sends
//! chunks as it receives them, and keepalives while it waits. When the transfer fails, the first worker requests the
//! remaining bytes from the master.
//!
//! ```text
//! PeerRequest ->      <- AssetBegin, AssetChunk | Ping ...   or AssetUnknown
//! ```
//!
//! A worker serves an asset only for its [`Token`], which the master computes from a [`ShareKey`] that only the master and
//! this worker have. There is no preamble: the master has checked that both workers have its own version.

#[cfg(feature = "transport")]
mod io;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::AssetId;

#[cfg(feature = "transport")]
pub use io::{receive_reply, receive_request, send_reply, send_request};

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

/// Request of a worker for an asset of another worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PeerRequest {
    /// The asset.
    pub id: AssetId,
    /// Token of the asset at the other worker.
    pub token: Token,
    /// First byte that is requested.
    pub offset: u64,
}

/// Part of the reply to a [`PeerRequest`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PeerReply {
    /// The asset is complete or will be, and chunks follow.
    Begin {
        /// Number of bytes of the whole asset.
        size: u64,
    },
    /// The next bytes.
    Chunk {
        /// Position of the bytes in the asset.
        offset: u64,
        /// The bytes.
        bytes: Bytes,
    },
    /// Keepalive: the sender waits for more bytes itself.
    Waiting,
    /// The sender does not have the asset, or the token is wrong.
    Unknown,
}
