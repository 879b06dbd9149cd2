//! Lets workers in and listens to each of them: one task a session. Whatever one peer does ends its own session only.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::limits::MAX_CHUNK_BYTES;
use rayfarm_protocol::session::{self, Receiver, SendError, Sender};
use rayfarm_protocol::{AssetId, Hello, ProtocolError, ToMaster, ToWorker, Welcome, handshake, tcp};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::driver::{AnswerError, Driver};
use crate::sessions::identity::Identity;
use crate::sessions::Session;
use rayfarm_scheduler::{Event, WorkerId};

/// Connections that have not shaken hands yet; more wait in the operating system's queue.
const MAX_HANDSHAKES: usize = 64;
/// Assets that a worker has asked for and not been sent yet.
const MAX_WANTED_ASSETS: usize = 4096;
/// After a failed accept (out of file descriptors, usually), so that it does not fail as fast as it can.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Why a session ended before its time.
#[derive(Debug, thiserror::Error)]
enum SessionError {
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    #[error(transparent)]
    Answer(#[from] AnswerError),
    #[error("it closed the connection without a goodbye")]
    Closed,
    #[error("it asks for more than {MAX_WANTED_ASSETS} assets at once")]
    Greedy,
}

/// Accepts workers until `stop`.
pub(crate) async fn accept(
    listener: TcpListener,
    driver: Arc<Driver>,
    sessions: TaskTracker,
    stop: CancellationToken,
) {
    let handshakes = Arc::new(Semaphore::new(MAX_HANDSHAKES));
    loop {
        let accepted = tokio::select! {
            () = stop.cancelled() => return,
            accepted = async {
                let place = handshakes.clone().acquire_owned().await;
                (listener.accept().await, place)
            } => accepted,
        };
        match accepted {
            (Ok((stream, address)), place) => {
                let (driver, stop) = (driver.clone(), stop.clone());
                sessions.spawn(async move {
                    let session = async {
                        if let Some(newcomer) = greet(&driver, stream, address).await {
                            drop(place);
                            serve(&driver, newcomer, address).await;
                        }
                    };
                    tokio::select! {
                        () = stop.cancelled() => {}
                        () = session => {}
                    }
                });
            }
            (Err(error), _) => {
                tracing::warn!("cannot accept a connection: {error}; trying again");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

/// A worker that has been let in.
struct Newcomer {
    worker: WorkerId,
    hello: Hello,
    identity: Identity,
    stream: TcpStream,
}

/// The handshake. Whoever fails it is logged, and has disturbed nobody.
async fn greet(driver: &Driver, mut stream: TcpStream, address: SocketAddr) -> Option<Newcomer> {
    if let Err(error) = tcp::configure(&stream) {
        tracing::debug!("{address}: cannot send small messages at once: {error}");
    }
    let mut admitted = None;
    let decide = |hello: &Hello| {
        let identity = driver.tickets.identify(&hello.name, address.ip());
        match driver.refusal(&identity) {
            Some(reason) => Err(reason),
            None => Ok(Welcome { worker: admitted.insert((driver.next_worker(), identity)).0.0 }),
        }
    };
    match handshake::as_master(&mut stream, decide).await {
        Ok(hello) => admitted.map(|(worker, identity)| {
            // A ticket is never shown.
            let hello = Hello { name: identity.name(), ..hello };
            Newcomer { worker, hello, identity, stream }
        }),
        // It comes back every few seconds.
        Err(error @ ProtocolError::NotNow { .. }) => {
            tracing::debug!("{address} was not let in: {error}");
            None
        }
        Err(error) => {
            tracing::warn!("{address} was not let in: {error}");
            None
        }
    }
}

/// A session from its beginning to its end.
async fn serve(driver: &Driver, newcomer: Newcomer, address: SocketAddr) {
    let Newcomer { worker, hello, identity, stream } = newcomer;
    let Hello { name, threads, simd, software } = hello.clone();
    tracing::info!("{worker} joins: {name} ({address}), {threads} threads, {simd}, {software}");
    let (sender, receiver, traffic) = session::spawn::<_, ToWorker, ToMaster>(stream);
    let (want, wanted) = mpsc::channel(MAX_WANTED_ASSETS);
    driver.join(worker, Session::new(hello, identity, address, sender.clone(), traffic));
    let ended = tokio::select! {
        ended = listen(driver, worker, receiver, want) => ended,
        () = send_assets(driver, worker, &sender, wanted) => Err(SessionError::Closed),
    };
    match ended {
        Ok(reason) => {
            tracing::info!("{worker} ({name}, {address}) leaves: {reason}");
            driver.leave(worker, "goodbye");
        }
        Err(error) => {
            // Logged by the driver where it was the driver who dismissed it.
            if driver.knows(worker) {
                tracing::warn!("{worker} ({name}, {address}) is lost: {error}");
            }
            driver.leave(worker, &error.to_string());
        }
    }
}

/// Takes what a worker says for as long as it makes sense. Returns the reason of its goodbye.
async fn listen(
    driver: &Driver,
    worker: WorkerId,
    mut receiver: Receiver<ToMaster>,
    want: mpsc::Sender<(AssetId, u64)>,
) -> Result<String, SessionError> {
    while let Some(message) = receiver.recv().await {
        match message? {
            ToMaster::Pixels { header, bytes } => driver.pixels(worker, header, &bytes)?,
            ToMaster::NeedAsset { id, offset, again } => {
                if !driver.asset_wanted(worker, id, offset, again) {
                    want.try_send((id, offset)).map_err(|_| SessionError::Greedy)?;
                }
            }
            ToMaster::Sharing { port } => driver.shares(worker, port),
            ToMaster::HaveAsset { id } => driver.asset_taken(worker, id),
            ToMaster::Pong { nonce } => driver.handle(Event::Pong { worker, nonce }),
            ToMaster::Failed { frame, reason } => driver.failed(worker, frame, reason),
            ToMaster::Drain => driver.handle(Event::WorkerDrains { worker }),
            ToMaster::Goodbye { reason } => return Ok(reason),
        }
    }
    Err(SessionError::Closed)
}

/// Sends the assets that a worker asks for, one after the other, as fast as it takes them. Ends with the session.
async fn send_assets(
    driver: &Driver,
    worker: WorkerId,
    sender: &Sender<ToWorker>,
    mut wanted: mpsc::Receiver<(AssetId, u64)>,
) {
    while let Some((id, offset)) = wanted.recv().await {
        let sent = match driver.assets.get(id) {
            Some(bytes) => send_asset(driver, worker, sender, id, bytes, offset).await,
            None => sender.send(ToWorker::AssetUnknown { id }).await,
        };
        match sent {
            Ok(()) => {}
            // What ended the session is the listener's to say.
            Err(SendError::Closed) => return std::future::pending().await,
            Err(SendError::Invalid(error)) => tracing::error!("asset {id} cannot be sent: {error}"),
        }
    }
}

/// An asset from some byte on.
async fn send_asset(
    driver: &Driver,
    worker: WorkerId,
    sender: &Sender<ToWorker>,
    id: AssetId,
    mut bytes: Bytes,
    mut offset: u64,
) -> Result<(), SendError> {
    sender.send(ToWorker::AssetBegin { id, size: bytes.len() as u64 }).await?;
    // From beyond its end there is nothing to send.
    let _ = bytes.split_to(usize::try_from(offset).unwrap_or(usize::MAX).min(bytes.len()));
    while !bytes.is_empty() {
        let chunk = bytes.split_to(bytes.len().min(MAX_CHUNK_BYTES));
        let next = offset + chunk.len() as u64;
        sender.send(ToWorker::AssetChunk { id, offset, bytes: chunk }).await?;
        offset = next;
        // On a slow link its answers to pings wait behind megabytes in the operating system's buffers.
        driver.asset_sent(worker, id, offset);
    }
    Ok(())
}
