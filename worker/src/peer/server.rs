//! Server that sends assets to other workers. A fault of one connection ends that connection only.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_protocol::admission::{Admission, AdmissionLimits, Place};
use rayfarm_protocol::limits::{
    MAX_CHUNK_BYTES, MAX_PEER_CLIENTS, MAX_PEER_KEEPALIVES, PEER_KEEPALIVE_INTERVAL,
};
use rayfarm_protocol::peer::{self, PeerReply, PeerRequest, receive_request, send_reply};
use rayfarm_protocol::transport::{Connection, WorkerSecurity};
use rayfarm_protocol::{AssetId, KeyHash, ProtocolError};
use tokio::io::{AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, SemaphorePermit};
use tokio::task::JoinSet;
use tokio::time::timeout;

use super::cache::Lookup;
use super::{PartialAsset, PeerCache};

/// Most connections without a valid token. Known hosts are those that have sent a valid one.
const LIMITS: AdmissionLimits = AdmissionLimits { unknown: 32, known: 32, here: 32, of_host: 8 };

/// Delay after a failed accept, so that a lasting failure does not become a busy loop.
const ACCEPT_RETRY_DELAY: Duration = Duration::from_millis(100);

/// Most connections with a valid token, served and waiting. Further ones are refused, and the master sends those assets.
const MAX_CONNECTIONS: usize = 64;

/// A running peer server: where it listens, and what it serves.
#[derive(Clone, Debug)]
pub(crate) struct PeerServer {
    pub(crate) port: u16,
    pub(crate) cache: Arc<PeerCache>,
}

/// What all connections of a server share.
struct Shared {
    cache: Arc<PeerCache>,
    security: WorkerSecurity,
    /// Connections without a valid token.
    admission: Admission,
    /// Places of connections with a valid token.
    connections: Semaphore,
    /// Places of transfers.
    transfers: Semaphore,
}

/// Accepts and serves other workers until the future is dropped.
pub(crate) async fn serve_peers(listener: TcpListener, cache: Arc<PeerCache>, security: WorkerSecurity) {
    let shared = Arc::new(Shared {
        cache,
        security,
        admission: Admission::new(LIMITS),
        connections: Semaphore::new(MAX_CONNECTIONS),
        transfers: Semaphore::new(MAX_PEER_CLIENTS),
    });
    let mut connections = JoinSet::new();
    loop {
        match listener.accept().await {
            Ok((stream, address)) => {
                // Without a place the connection is closed: its host has as many that are not silent.
                let Some(place) = shared.admission.enter(address.ip()) else { continue };
                let shared = Arc::clone(&shared);
                connections.spawn(async move { serve_connection(stream, address, place, &shared).await });
            }
            Err(error) => {
                tracing::debug!("cannot accept a connection of another worker: {error}");
                tokio::time::sleep(ACCEPT_RETRY_DELAY).await;
            }
        }
        while connections.try_join_next().is_some() {}
    }
}

async fn serve_connection(stream: TcpStream, address: SocketAddr, place: Place, shared: &Shared) {
    let accepted = tokio::select! {
        biased;
        () = place.closed() => return,
        accepted = accept(stream, &place, shared) => accepted,
    };
    drop(place);
    let served = match accepted {
        Ok(Accepted { mut stream, request, client, connection: Some(_connection) }) => {
            shared.admission.add_known(address.ip());
            serve_request(&mut stream, &request, client, shared).await
        }
        Ok(Accepted { mut stream, request, .. }) => refuse(&mut stream, request.id).await,
        Err(error) => Err(error),
    };
    if let Err(error) = served {
        tracing::debug!("the transfer of an asset to {address} failed: {error}");
    }
}

/// A connection whose request has arrived.
struct Accepted<'a> {
    stream: Connection<TcpStream>,
    request: PeerRequest,
    /// Hash of the other worker's public key, with TLS.
    client: Option<KeyHash>,
    /// The place of a connection with a valid token. `None`: the token is wrong, or there is no place.
    connection: Option<SemaphorePermit<'a>>,
}

/// Shakes hands and receives the request.
async fn accept<'a>(
    stream: TcpStream,
    place: &Place,
    shared: &'a Shared,
) -> Result<Accepted<'a>, ProtocolError> {
    // Every message is flushed as a whole, so there is nothing to gather.
    let _ = stream.set_nodelay(true);
    place.wait_for_first_byte(&stream).await?;
    let mut stream = peer::accept(stream, &shared.security).await?;
    let client = stream.peer_key();
    let request = receive_request(&mut stream).await?;
    let is_valid = !matches!(shared.cache.lookup(&request, client), Lookup::Denied);
    let connection = if is_valid { shared.connections.try_acquire().ok() } else { None };
    Ok(Accepted { stream, request, client, connection })
}

/// Sends the requested asset as its bytes arrive, and closes. An abandoned asset closes the connection early.
async fn serve_request(
    stream: &mut (impl AsyncWrite + Unpin),
    request: &PeerRequest,
    client: Option<KeyHash>,
    shared: &Shared,
) -> Result<(), ProtocolError> {
    let Some(_transfer) = wait_for_transfer(stream, request.id, shared).await? else {
        return refuse(stream, request.id).await;
    };
    let Some(asset) = wait_for_asset(stream, request, client, &shared.cache).await? else {
        return refuse(stream, request.id).await;
    };
    send_reply(stream, request.id, PeerReply::Begin { size: asset.size() as u64 }).await?;
    let offset = usize::try_from(request.offset).unwrap_or(usize::MAX);
    send_chunks(stream, request.id, &asset, offset, &shared.cache).await?;
    close(stream).await
}

/// Replies that the asset is not served, and closes.
async fn refuse(stream: &mut (impl AsyncWrite + Unpin), id: AssetId) -> Result<(), ProtocolError> {
    send_reply(stream, id, PeerReply::Unknown).await?;
    close(stream).await
}

async fn close(stream: &mut (impl AsyncWrite + Unpin)) -> Result<(), ProtocolError> {
    stream.shutdown().await.map_err(|source| ProtocolError::Io { doing: "sending", source })
}

/// A keepalive.
fn waiting(cache: &PeerCache) -> PeerReply {
    PeerReply::Waiting { hops: cache.stall_clock().hops_of_next() }
}

/// Waits until one of the transfers has ended, with keepalives. Returns `None` where none ends in time.
async fn wait_for_transfer<'a>(
    stream: &mut (impl AsyncWrite + Unpin),
    id: AssetId,
    shared: &'a Shared,
) -> Result<Option<SemaphorePermit<'a>>, ProtocolError> {
    for _ in 0..MAX_PEER_KEEPALIVES {
        match timeout(PEER_KEEPALIVE_INTERVAL, shared.transfers.acquire()).await {
            Ok(permit) => return Ok(permit.ok()),
            Err(_) => send_reply(stream, id, waiting(&shared.cache)).await?,
        }
    }
    Ok(None)
}

/// Waits until the transfer of the requested asset to this worker begins. Returns `None` for a denied request.
async fn wait_for_asset(
    stream: &mut (impl AsyncWrite + Unpin),
    request: &PeerRequest,
    client: Option<KeyHash>,
    cache: &PeerCache,
) -> Result<Option<Arc<PartialAsset>>, ProtocolError> {
    for _ in 0..MAX_PEER_KEEPALIVES {
        let inserted = cache.inserted();
        match cache.lookup(request, client) {
            Lookup::Found(asset) => return Ok(Some(asset)),
            Lookup::Denied => return Ok(None),
            Lookup::Expected => {}
        }
        if timeout(PEER_KEEPALIVE_INTERVAL, inserted).await.is_err() {
            send_reply(stream, request.id, waiting(cache)).await?;
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
    cache: &PeerCache,
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
            Err(_) => send_reply(stream, id, waiting(cache)).await?,
        }
    }
    Ok(())
}
