//! The exchange of one request and its reply between two workers.

use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::time::timeout;

use super::{Fetch, Passed};
use crate::envelope::{Kind, read_body, read_header};
use crate::limits::{HANDSHAKE_DEADLINE, PEER_PATIENCE};
use crate::message::{Message, decode_control, encode_control};
use crate::{AssetId, ProtocolError, ToWorker};

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
