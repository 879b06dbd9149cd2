//! Server that sends assets to other workers. A fault of one connection ends that connection only.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_protocol::limits::{
    MAX_CHUNK_BYTES, MAX_PEER_CLIENTS, MAX_PEER_KEEPALIVES, PEER_KEEPALIVE_INTERVAL,
};
use rayfarm_protocol::peer::{PeerReply, PeerRequest, receive_request, send_reply};
use rayfarm_protocol::{AssetId, ProtocolError};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio::task::JoinSet;
use tokio::time::timeout;

use super::cache::Lookup;
use super::{PartialAsset, PeerCache};

/// Delay after a failed accept, so that a lasting failure does not become a busy loop.
const ACCEPT_RETRY_DELAY: Duration = Duration::from_millis(100);

/// A running peer server: where it listens, and what it serves.
#[derive(Clone, Debug)]
pub(crate) struct PeerServer {
    pub(crate) port: u16,
    pub(crate) cache: Arc<PeerCache>,
}

/// Accepts and serves other workers until the future is dropped.
pub(crate) async fn serve_peers(listener: TcpListener, cache: Arc<PeerCache>) {
    let permits = Arc::new(Semaphore::new(MAX_PEER_CLIENTS));
    let mut connections = JoinSet::new();
    loop {
        let permit = Arc::clone(&permits).acquire_owned().await;
        match listener.accept().await {
            Ok((stream, address)) => {
                let cache = Arc::clone(&cache);
                // Every message is flushed as a whole, so there is nothing to gather.
                let _ = stream.set_nodelay(true);
                connections.spawn(async move {
                    serve_connection(stream, address, &cache).await;
                    drop(permit);
                });
            }
            Err(error) => {
                tracing::debug!("cannot accept a connection of another worker: {error}");
                tokio::time::sleep(ACCEPT_RETRY_DELAY).await;
            }
        }
        while connections.try_join_next().is_some() {}
    }
}

async fn serve_connection(
    mut stream: impl AsyncRead + AsyncWrite + Unpin,
    address: SocketAddr,
    cache: &PeerCache,
) {
    if let Err(error) = serve_request(&mut stream, cache).await {
        tracing::debug!("the transfer of an asset to {address} failed: {error}");
    }
}

/// Receives one request, sends its asset as the bytes arrive, and closes. An abandoned asset closes the connection early.
async fn serve_request(
    stream: &mut (impl AsyncRead + AsyncWrite + Unpin),
    cache: &PeerCache,
) -> Result<(), ProtocolError> {
    let request = receive_request(stream).await?;
    match wait_for_asset(stream, &request, cache).await? {
        Some(asset) => {
            send_reply(stream, request.id, PeerReply::Begin { size: asset.size() as u64 }).await?;
            let offset = usize::try_from(request.offset).unwrap_or(usize::MAX);
            send_chunks(stream, request.id, &asset, offset).await?;
        }
        None => send_reply(stream, request.id, PeerReply::Unknown).await?,
    }
    stream.shutdown().await.map_err(|source| ProtocolError::Io { doing: "sending", source })
}

/// Waits until the transfer of the requested asset to this worker begins. Returns `None` for a denied request.
async fn wait_for_asset(
    stream: &mut (impl AsyncWrite + Unpin),
    request: &PeerRequest,
    cache: &PeerCache,
) -> Result<Option<Arc<PartialAsset>>, ProtocolError> {
    for _ in 0..MAX_PEER_KEEPALIVES {
        let inserted = cache.inserted();
        match cache.lookup(request) {
            Lookup::Found(asset) => return Ok(Some(asset)),
            Lookup::Denied => return Ok(None),
            Lookup::Expected => {}
        }
        if timeout(PEER_KEEPALIVE_INTERVAL, inserted).await.is_err() {
            send_reply(stream, request.id, PeerReply::Waiting).await?;
        }
    }
    Ok(None)
}

/// Sends the bytes of an asset from `offset` on as they arrive, with keepalives between them.
async fn send_chunks(
    stream: &mut (impl AsyncWrite + Unpin),
    id: AssetId,
    asset: &PartialAsset,
    mut offset: usize,
) -> Result<(), ProtocolError> {
    let mut progress = asset.subscribe();
    while offset < asset.size() {
        let now = *progress.borrow_and_update();
        if now.abandoned {
            return Ok(());
        }
        // Waits for a full chunk while more bytes arrive, because a small chunk costs as much as a full one.
        let due = MAX_CHUNK_BYTES.min(asset.size() - offset);
        if now.len >= offset.saturating_add(due) {
            let bytes = asset.read(offset, due);
            if bytes.is_empty() {
                return Ok(());
            }
            let next = offset + bytes.len();
            send_reply(stream, id, PeerReply::Chunk { offset: offset as u64, bytes }).await?;
            offset = next;
            continue;
        }
        match timeout(PEER_KEEPALIVE_INTERVAL, progress.changed()).await {
            Ok(Ok(())) => {}
            Ok(Err(_)) => return Ok(()),
            Err(_) => send_reply(stream, id, PeerReply::Waiting).await?,
        }
    }
    Ok(())
}
