//! Client that fetches an asset from another worker. The session receives every outcome; after a failure it requests the
//! remaining bytes from the master.

use std::net::SocketAddr;

use bytes::Bytes;
use rayfarm_protocol::limits::{MAX_PEER_KEEPALIVES, PEER_CONNECT_TIMEOUT};
use rayfarm_protocol::peer::{self, PeerReply, PeerRequest, Token, receive_reply, send_request};
use rayfarm_protocol::transport::WorkerSecurity;
use rayfarm_protocol::{AssetId, KeyHash, ProtocolError};
use tokio::io::{AsyncRead, AsyncWrite, BufReader};
use tokio::net::TcpStream;
use tokio::sync::mpsc;

use super::address_rules;

/// Another worker that serves an asset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PeerSource {
    pub(crate) address: SocketAddr,
    /// Hash of its public key. `None` where connections are plain.
    pub(crate) key: Option<KeyHash>,
    pub(crate) token: Token,
}

/// Settings of the connections to other workers.
#[derive(Clone, Debug)]
pub(crate) struct PeerClient {
    /// Whether connections use TLS, and with which key.
    pub(crate) security: WorkerSecurity,
    /// Whether the master is on this machine, and so may name addresses of it.
    pub(crate) within_machine: bool,
}

/// Event of a transfer from another worker.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum PeerEvent {
    /// A part of an asset arrived.
    Chunk { id: AssetId, offset: u64, bytes: Bytes },
    /// The transfer failed, for this reason.
    Failed { id: AssetId, why: String },
}

impl PeerClient {
    /// Fetches an asset of `size` bytes and sends its chunks to `events` as they arrive.
    pub(crate) async fn fetch(
        self,
        id: AssetId,
        size: u64,
        source: PeerSource,
        events: mpsc::Sender<PeerEvent>,
    ) {
        if let Err(why) = self.try_fetch(id, size, source, &events).await {
            let why = format!("the transfer from {} failed: {why}", source.address);
            // The receiver is closed where the session has ended.
            let _ = events.send(PeerEvent::Failed { id, why }).await;
        }
    }

    async fn try_fetch(
        &self,
        id: AssetId,
        size: u64,
        source: PeerSource,
        events: &mpsc::Sender<PeerEvent>,
    ) -> Result<(), String> {
        address_rules::check(source.address, self.within_machine)?;
        let connecting = tokio::time::timeout(PEER_CONNECT_TIMEOUT, TcpStream::connect(source.address));
        let stream = match connecting.await {
            Ok(connected) => connected.map_err(|error| error.to_string())?,
            Err(_) => return Err(format!("no connection within {} s", PEER_CONNECT_TIMEOUT.as_secs())),
        };
        let connected = peer::connect(stream, &self.security, source.key).await;
        let stream = connected.map_err(|error| error.to_string())?;
        fetch_over(stream, id, size, source.token, events).await
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
