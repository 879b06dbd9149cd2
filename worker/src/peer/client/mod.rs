//! Client that fetches an asset from another worker. The session receives every outcome; after a failure it requests the
//! remaining bytes from the master.

use std::net::SocketAddr;
use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::limits::{MAX_CHUNK_BYTES, MAX_PEER_KEEPALIVES, PEER_CONNECT_TIMEOUT};
use rayfarm_protocol::peer::{self, PeerReply, PeerRequest, Token, receive_reply, send_request};
use rayfarm_protocol::transport::WorkerSecurity;
use rayfarm_protocol::{AssetId, KeyHash, ProtocolError};
use tokio::io::{AsyncRead, AsyncWrite, BufReader};
use tokio::net::TcpStream;
use tokio::sync::mpsc;

use super::{StallClock, address_rules};

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

/// An asset to fetch from another worker.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fetch {
    pub(crate) id: AssetId,
    /// Number of bytes of the asset.
    pub(crate) size: u64,
    pub(crate) source: PeerSource,
}

impl PeerClient {
    /// Fetches an asset and sends its chunks to `events` as they arrive. A transfer that stalls by `clock` fails.
    pub(crate) async fn fetch(self, fetch: Fetch, clock: Arc<StallClock>, events: mpsc::Sender<PeerEvent>) {
        if let Err(why) = self.try_fetch(fetch, &clock, &events).await {
            let Fetch { id, source, .. } = fetch;
            let why = format!("the transfer from {} failed: {why}", source.address);
            // The receiver is closed where the session has ended.
            let _ = events.send(PeerEvent::Failed { id, why }).await;
        }
    }

    async fn try_fetch(
        &self,
        fetch: Fetch,
        clock: &StallClock,
        events: &mpsc::Sender<PeerEvent>,
    ) -> Result<(), String> {
        let PeerSource { address, key, .. } = fetch.source;
        address_rules::check(address, self.within_machine)?;
        let connecting = tokio::time::timeout(PEER_CONNECT_TIMEOUT, TcpStream::connect(address));
        let stream = match connecting.await {
            Ok(connected) => connected.map_err(|error| error.to_string())?,
            Err(_) => return Err(format!("no connection within {} s", PEER_CONNECT_TIMEOUT.as_secs())),
        };
        let connected = peer::connect(stream, &self.security, key).await;
        let stream = connected.map_err(|error| error.to_string())?;
        fetch_over(stream, fetch, clock, events).await
    }
}

async fn fetch_over(
    mut stream: impl AsyncRead + AsyncWrite + Unpin,
    fetch: Fetch,
    clock: &StallClock,
    events: &mpsc::Sender<PeerEvent>,
) -> Result<(), String> {
    let Fetch { id, size, source: PeerSource { token, .. }, .. } = fetch;
    let text = |error: ProtocolError| error.to_string();
    let stalled = clock.stalled();
    tokio::pin!(stalled);
    send_request(&mut stream, &PeerRequest { id, token, offset: 0 }).await.map_err(text)?;
    let mut stream = BufReader::new(stream);
    let (mut offset, mut keepalives) = (0, 0);
    while offset < size {
        let reply = tokio::select! {
            biased;
            reply = receive_reply(&mut stream, id) => reply.map_err(text)?,
            () = &mut stalled => {
                return Err(format!("no chunk arrived for {} s", clock.limit().as_secs_f32()));
            }
        };
        match reply {
            PeerReply::Begin { size: announced } if announced == size => {}
            PeerReply::Begin { size: announced } => {
                return Err(format!("it announces {announced} bytes, expected {size}"));
            }
            PeerReply::Unknown => return Err("it does not have the asset".to_owned()),
            PeerReply::Waiting { hops } if keepalives < MAX_PEER_KEEPALIVES => {
                keepalives += 1;
                clock.note_hops(hops);
            }
            PeerReply::Waiting { .. } => return Err(format!("it sent {keepalives} keepalives and no chunk")),
            PeerReply::Chunk { offset: at, bytes } => {
                // Each chunk but the last is full, so that a source which sends at all has a least rate.
                let (end, due) = (at.saturating_add(bytes.len() as u64), size - offset);
                let full = due.min(MAX_CHUNK_BYTES as u64);
                if at != offset || bytes.len() as u64 != full {
                    let len = bytes.len();
                    return Err(format!(
                        "{len} bytes at byte {at} arrived, expected {full} at byte {offset} of {size}"
                    ));
                }
                (offset, keepalives) = (end, 0);
                clock.note_chunk();
                if events.send(PeerEvent::Chunk { id, offset: at, bytes }).await.is_err() {
                    return Ok(());
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
