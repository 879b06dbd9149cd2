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
//! this worker have, and from the key of the worker that requests the asset. There is no preamble: the master has checked
//! that both workers have its own version.
//!
//! Workers that join their master through TLS use TLS between each other as well, with their own keys: see [`connect`] and
//! [`accept`].

#[cfg(feature = "transport")]
mod io;
#[cfg(feature = "transport")]
mod secure;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::AssetId;

#[cfg(feature = "transport")]
pub use io::{receive_reply, receive_request, send_reply, send_request};
#[cfg(feature = "transport")]
pub use secure::{accept, connect};

pub use crate::token::{ShareKey, Token};

/// Request of a worker for an asset of another worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PeerRequest {
    /// Asset that is requested.
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
    Waiting {
        /// Number of workers between the master and the receiver.
        hops: u64,
    },
    /// The sender does not have the asset, or the token is wrong.
    Unknown,
}
