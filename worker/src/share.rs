//! Passes assets on to other workers. Whatever one of them does ends its own connection only.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_protocol::limits::{MAX_CHUNK_BYTES, MAX_PEER_CLIENTS, MAX_PEER_KEEPALIVES, PEER_KEEPALIVE_INTERVAL};
use rayfarm_protocol::peer::{Fetch, Passed, hear, pass};
use rayfarm_protocol::{AssetId, ProtocolError};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio::task::JoinSet;

use crate::growing::Growing;
use crate::shelf::{Opened, Shelf};

/// After a failed accept, so that it does not fail as fast as it can.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Serves whoever connects, until it is dropped.
pub(crate) async fn share(listener: TcpListener, shelf: Arc<Shelf>) {
    let places = Arc::new(Semaphore::new(MAX_PEER_CLIENTS));
    let mut followers = JoinSet::new();
    loop {
        let place = Arc::clone(&places).acquire_owned().await;
        match listener.accept().await {
            Ok((stream, address)) => {
                let shelf = Arc::clone(&shelf);
                // It sends large messages or none.
                let _ = stream.set_nodelay(true);
                followers.spawn(async move {
                    serve(stream, address, &shelf).await;
                    drop(place);
                });
            }
            Err(error) => {
                tracing::debug!("cannot accept a worker that wants an asset: {error}");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
        while followers.try_join_next().is_some() {}
    }
}

async fn serve(mut stream: impl AsyncRead + AsyncWrite + Unpin, address: SocketAddr, shelf: &Shelf) {
    if let Err(error) = answer(&mut stream, shelf).await {
        tracing::debug!("{address} was not given an asset: {error}");
    }
}

/// Hears what is wanted and gives it, as it comes in. Closes where it will not come.
pub(crate) async fn answer(
    stream: &mut (impl AsyncRead + AsyncWrite + Unpin),
    shelf: &Shelf,
) -> Result<(), ProtocolError> {
    let fetch = hear(stream).await?;
    match wait_for(stream, &fetch, shelf).await? {
        Some(bytes) => {
            pass(stream, fetch.id, Passed::Begin { size: bytes.size() as u64 }).await?;
            pass_on(stream, fetch.id, &bytes, usize::try_from(fetch.offset).unwrap_or(usize::MAX)).await?;
        }
        None => pass(stream, fetch.id, Passed::Unknown).await?,
    }
    stream.shutdown().await.map_err(|source| ProtocolError::Io { doing: "sending", source })
}

/// What is asked for, when its first byte is about to come.
async fn wait_for(
    stream: &mut (impl AsyncWrite + Unpin),
    fetch: &Fetch,
    shelf: &Shelf,
) -> Result<Option<Arc<Growing>>, ProtocolError> {
    for _ in 0..MAX_PEER_KEEPALIVES {
        let filled = shelf.filled();
        match shelf.open(fetch) {
            Opened::Here(bytes) => return Ok(Some(bytes)),
            Opened::Closed => return Ok(None),
            Opened::Expected => {}
        }
        if tokio::time::timeout(PEER_KEEPALIVE_INTERVAL, filled).await.is_err() {
            pass(stream, fetch.id, Passed::Waits).await?;
        }
    }
    Ok(None)
}

async fn pass_on(
    stream: &mut (impl AsyncWrite + Unpin),
    id: AssetId,
    bytes: &Growing,
    mut offset: usize,
) -> Result<(), ProtocolError> {
    let mut progress = bytes.watch();
    while offset < bytes.size() {
        let now = *progress.borrow_and_update();
        if now.abandoned {
            return Ok(());
        }
        // While more is coming, a whole chunk is waited for: small ones cost as much.
        let due = MAX_CHUNK_BYTES.min(bytes.size() - offset);
        if now.len >= offset.saturating_add(due) {
            let part = bytes.part(offset, due);
            if part.is_empty() {
                return Ok(());
            }
            let next = offset + part.len();
            pass(stream, id, Passed::Chunk { offset: offset as u64, bytes: part }).await?;
            offset = next;
            continue;
        }
        match tokio::time::timeout(PEER_KEEPALIVE_INTERVAL, progress.changed()).await {
            Ok(Ok(())) => {}
            Ok(Err(_)) => return Ok(()),
            Err(_) => pass(stream, id, Passed::Waits).await?,
        }
    }
    Ok(())
}
