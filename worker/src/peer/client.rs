//! Client that fetches an asset from another worker. The session receives every outcome; after a failure it requests the
//! remaining bytes from the master.

use std::net::SocketAddr;

use bytes::Bytes;
use rayfarm_protocol::limits::{MAX_PEER_KEEPALIVES, PEER_CONNECT_TIMEOUT};
use rayfarm_protocol::peer::{PeerReply, PeerRequest, Token, receive_reply, send_request};
use rayfarm_protocol::{AssetId, ProtocolError};
use tokio::io::{AsyncRead, AsyncWrite, BufReader};
use tokio::net::TcpStream;
use tokio::sync::mpsc;

/// Another worker that serves an asset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PeerSource {
    pub(crate) address: SocketAddr,
    pub(crate) token: Token,
}

/// Event of a transfer from another worker.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum PeerEvent {
    /// A part of an asset arrived.
    Chunk { id: AssetId, offset: u64, bytes: Bytes },
    /// The transfer failed, for this reason.
    Failed { id: AssetId, why: String },
}

/// Fetches an asset of `size` bytes and sends its chunks to `events` as they arrive.
pub(crate) async fn fetch_from_peer(
    id: AssetId,
    size: u64,
    source: PeerSource,
    events: mpsc::Sender<PeerEvent>,
) {
    let connecting = tokio::time::timeout(PEER_CONNECT_TIMEOUT, TcpStream::connect(source.address));
    let failure = match connecting.await {
        Ok(Ok(stream)) => fetch_over(stream, id, size, source.token, &events).await.err(),
        Ok(Err(error)) => Some(error.to_string()),
        Err(_) => Some(format!("no connection within {} s", PEER_CONNECT_TIMEOUT.as_secs())),
    };
    if let Some(why) = failure {
        let why = format!("the transfer from {} failed: {why}", source.address);
        // The receiver is closed where the session has ended.
        let _ = events.send(PeerEvent::Failed { id, why }).await;
    }
}

async fn fetch_over(
    mut stream: impl AsyncRead + AsyncWrite + Unpin,
    id: AssetId,
    size: u64,
    token: Token,
    events: &mpsc::Sender<PeerEvent>,
) -> Result<(), String> {
    let text = |error: ProtocolError| error.to_string();
    send_request(&mut stream, &PeerRequest { id, token, offset: 0 }).await.map_err(text)?;
    let mut stream = BufReader::new(stream);
    let (mut offset, mut keepalives) = (0, 0);
    while offset < size {
        match receive_reply(&mut stream, id).await.map_err(text)? {
            PeerReply::Begin { size: announced } if announced == size => {}
            PeerReply::Begin { size: announced } => {
                return Err(format!("it announces {announced} bytes, expected {size}"));
            }
            PeerReply::Unknown => return Err("it does not have the asset".to_owned()),
            PeerReply::Waiting if keepalives < MAX_PEER_KEEPALIVES => keepalives += 1,
            PeerReply::Waiting => return Err(format!("it sent {keepalives} keepalives and no chunk")),
            PeerReply::Chunk { offset: at, bytes } => {
                let end = at.saturating_add(bytes.len() as u64);
                if at != offset || end > size {
                    return Err(format!("a chunk at byte {at} arrived, expected byte {offset} of {size}"));
                }
                (offset, keepalives) = (end, 0);
                if events.send(PeerEvent::Chunk { id, offset: at, bytes }).await.is_err() {
                    return Ok(());
                }
            }
        }
    }
    Ok(())
}
