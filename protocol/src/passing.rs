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

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::time::timeout;

use crate::envelope::{Kind, read_body, read_header};
use crate::limits::{HANDSHAKE_DEADLINE, PEER_PATIENCE};
use crate::message::{Message, decode_control, encode_control};
use crate::{AssetId, ProtocolError, ToWorker};

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

/// Asks.
///
/// # Errors
/// The transport's; a peer that does not take it in time.
pub async fn ask(io: &mut (impl AsyncWrite + Unpin), fetch: &Fetch) -> Result<(), ProtocolError> {
    encode_control(Kind::Fetch, fetch)?.write(io).await?;
    flush(io).await
}

/// Hears what is asked for.
///
/// # Errors
/// Bytes that ask for nothing; a peer that does not ask in time.
pub async fn hear(io: &mut (impl AsyncRead + Unpin)) -> Result<Fetch, ProtocolError> {
    let asked = async {
        let header =
            read_header(io).await?.ok_or(ProtocolError::Closed { at: "before it asked for anything" })?;
        if header.kind != Kind::Fetch {
            return Err(ProtocolError::Unexpected {
                kind: header.kind,
                expected: "what a worker asks another for",
            });
        }
        decode_control(Kind::Fetch, &read_body(io, header).await?)
    };
    let late = ProtocolError::Deadline { what: "asking for an asset", limit: HANDSHAKE_DEADLINE };
    timeout(HANDSHAKE_DEADLINE, asked).await.unwrap_or(Err(late))
}

/// Answers, for an asset of this name.
///
/// # Errors
/// The transport's; a peer that does not take it in time; bounds.
pub async fn pass(
    io: &mut (impl AsyncWrite + Unpin),
    id: AssetId,
    passed: Passed,
) -> Result<(), ProtocolError> {
    let message = match passed {
        Passed::Begin { size } => ToWorker::AssetBegin { id, size },
        Passed::Chunk { offset, bytes } => ToWorker::AssetChunk { id, offset, bytes },
        Passed::Waits => ToWorker::Ping { nonce: 0 },
        Passed::Unknown => ToWorker::AssetUnknown { id },
    };
    message.to_envelope()?.write(io).await?;
    flush(io).await
}

/// The next part of the answer about an asset of this name.
///
/// # Errors
/// Anything else; a peer that closes, or is silent for [`PEER_PATIENCE`].
pub async fn next(io: &mut (impl AsyncRead + Unpin), id: AssetId) -> Result<Passed, ProtocolError> {
    const EXPECTED: &str = "a part of an asset that was asked for";
    let message = async {
        let header =
            read_header(io).await?.ok_or(ProtocolError::Closed { at: "between two parts of an asset" })?;
        let kind = header.kind;
        match kind {
            Kind::AssetBegin | Kind::AssetChunk | Kind::AssetUnknown | Kind::Ping => {
                ToWorker::from_body(kind, read_body(io, header).await?).map(|message| (kind, message))
            }
            _ => Err(ProtocolError::Unexpected { kind, expected: EXPECTED }),
        }
    };
    let late = ProtocolError::Deadline { what: "sending a part of an asset", limit: PEER_PATIENCE };
    let (kind, message) = timeout(PEER_PATIENCE, message).await.unwrap_or(Err(late))?;
    match message {
        ToWorker::AssetBegin { id: of, size } if of == id => Ok(Passed::Begin { size }),
        ToWorker::AssetChunk { id: of, offset, bytes } if of == id => Ok(Passed::Chunk { offset, bytes }),
        ToWorker::AssetUnknown { id: of } if of == id => Ok(Passed::Unknown),
        ToWorker::Ping { .. } => Ok(Passed::Waits),
        _ => Err(ProtocolError::Unexpected { kind, expected: EXPECTED }),
    }
}

async fn flush(io: &mut (impl AsyncWrite + Unpin)) -> Result<(), ProtocolError> {
    let late = ProtocolError::Deadline { what: "taking a part of an asset", limit: PEER_PATIENCE };
    let flushed = timeout(PEER_PATIENCE, io.flush()).await.map_err(|_| late)?;
    flushed.map_err(|source| ProtocolError::Io { doing: "sending", source })
}
