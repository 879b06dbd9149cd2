//! Requests and replies between two workers on an asynchronous byte stream, each with a deadline.

use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::time::timeout;

use super::{PeerReply, PeerRequest};
use crate::envelope::{Kind, read_body, read_header};
use crate::limits::{HANDSHAKE_DEADLINE, PEER_TIMEOUT};
use crate::message::{Message, decode_control, encode_control};
use crate::{AssetId, ProtocolError, ToWorker};

/// Sends a request and flushes it.
///
/// # Errors
/// A failed transport; a peer that does not receive the request in time.
pub async fn send_request(
    io: &mut (impl AsyncWrite + Unpin),
    request: &PeerRequest,
) -> Result<(), ProtocolError> {
    encode_control(Kind::PeerRequest, request)?.write(io).await?;
    flush(io).await
}

/// Receives a request.
///
/// # Errors
/// Bytes that are no request; a peer that sends none within [`HANDSHAKE_DEADLINE`].
pub async fn receive_request(io: &mut (impl AsyncRead + Unpin)) -> Result<PeerRequest, ProtocolError> {
    let request = async {
        let header = read_header(io).await?.ok_or(ProtocolError::Closed { at: "before its request" })?;
        if header.kind != Kind::PeerRequest {
            return Err(ProtocolError::Unexpected { kind: header.kind, expected: "a request of a worker" });
        }
        decode_control(Kind::PeerRequest, &read_body(io, header).await?)
    };
    let late = ProtocolError::Deadline { what: "a request for an asset", limit: HANDSHAKE_DEADLINE };
    timeout(HANDSHAKE_DEADLINE, request).await.unwrap_or(Err(late))
}

/// Sends a part of the reply about the asset `id` and flushes it.
///
/// # Errors
/// A failed transport; a peer that does not receive the part in time; a value out of bounds.
pub async fn send_reply(
    io: &mut (impl AsyncWrite + Unpin),
    id: AssetId,
    reply: PeerReply,
) -> Result<(), ProtocolError> {
    let message = match reply {
        PeerReply::Begin { size } => ToWorker::AssetBegin { id, size },
        PeerReply::Chunk { offset, bytes } => ToWorker::AssetChunk { id, offset, bytes },
        PeerReply::Waiting { hops } => ToWorker::Ping { nonce: hops },
        PeerReply::Unknown => ToWorker::AssetUnknown { id },
    };
    message.to_envelope()?.write(io).await?;
    flush(io).await
}

/// Receives the next part of the reply about the asset `id`.
///
/// # Errors
/// A message that is no such part; a peer that closes, or is silent for [`PEER_TIMEOUT`].
pub async fn receive_reply(
    io: &mut (impl AsyncRead + Unpin),
    id: AssetId,
) -> Result<PeerReply, ProtocolError> {
    const EXPECTED: &str = "a part of the requested asset";
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
    let late = ProtocolError::Deadline { what: "sending a part of an asset", limit: PEER_TIMEOUT };
    let (kind, message) = timeout(PEER_TIMEOUT, message).await.unwrap_or(Err(late))?;
    match message {
        ToWorker::AssetBegin { id: of, size } if of == id => Ok(PeerReply::Begin { size }),
        ToWorker::AssetChunk { id: of, offset, bytes } if of == id => Ok(PeerReply::Chunk { offset, bytes }),
        ToWorker::AssetUnknown { id: of } if of == id => Ok(PeerReply::Unknown),
        ToWorker::Ping { nonce: hops } => Ok(PeerReply::Waiting { hops }),
        _ => Err(ProtocolError::Unexpected { kind, expected: EXPECTED }),
    }
}

async fn flush(io: &mut (impl AsyncWrite + Unpin)) -> Result<(), ProtocolError> {
    let late = ProtocolError::Deadline { what: "receiving a part of an asset", limit: PEER_TIMEOUT };
    let flushed = timeout(PEER_TIMEOUT, io.flush()).await.map_err(|_| late)?;
    flushed.map_err(|source| ProtocolError::Io { doing: "sending", source })
}
