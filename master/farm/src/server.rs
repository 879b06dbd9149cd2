//! The listener: accepts connections, shakes hands, and runs one task per session. An error of a peer ends its own session
//! only.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfarm_protocol::admission::Place;
use rayfarm_protocol::limits::MAX_CHUNK_BYTES;
use rayfarm_protocol::session::{self, BodyLimit, Receiver, SendError, Sender};
use rayfarm_protocol::transport::Connection;
use rayfarm_protocol::{AssetId, Hello, KeyHash, ProtocolError, ToMaster, ToWorker, Welcome, handshake, tcp};
use rayfarm_scheduler::{Event, WorkerId};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::bucket::Rate;
use crate::driver::{AnswerError, Driver};
use crate::line_budget::{LineBudget, more};
use crate::sessions::budget::{Budget, OverBudget};
use crate::sessions::identity::Identity;
use crate::sessions::{Link, Session};

/// Asset requests of a worker that wait to be served.
const MAX_ASSET_REQUESTS: usize = 4096;
/// Delay after a failed accept, which usually means that file descriptors have run out.
const ACCEPT_RETRY_DELAY: Duration = Duration::from_millis(100);
/// Log lines about failed accepts.
const ACCEPT_LINES: Rate = Rate { burst: 4.0, per_second: 0.1 };

/// An error that ends a session.
#[derive(Debug, thiserror::Error)]
enum SessionError {
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    #[error(transparent)]
    Answer(#[from] AnswerError),
    #[error(transparent)]
    OverBudget(#[from] OverBudget),
    #[error("it closed the connection without a disconnect message")]
    Closed,
    #[error("it requests more than {MAX_ASSET_REQUESTS} assets at once")]
    TooManyRequests,
}

/// Accepts connections until `stop`, and runs their sessions.
pub(crate) async fn accept(
    listener: TcpListener,
    driver: Arc<Driver>,
    sessions: TaskTracker,
    stop: CancellationToken,
) {
    let mut failures = LineBudget::new(ACCEPT_LINES, Instant::now());
    loop {
        let accepted = tokio::select! {
            () = stop.cancelled() => return,
            accepted = listener.accept() => accepted,
        };
        match accepted {
            Ok((stream, address)) => {
                // Without a place the connection is closed: its host has as many that are not silent.
                let Some(place) = driver.door.enter(address.ip()) else { continue };
                let (driver, stop) = (driver.clone(), stop.clone());
                sessions.spawn(async move {
                    let session = async {
                        let admitted = tokio::select! {
                            biased;
                            () = place.closed() => None,
                            admitted = shake_hands(&driver, stream, address, &place) => admitted,
                        };
                        drop(place);
                        if let Some(admitted) = admitted {
                            run_session(&driver, admitted, address).await;
                        }
                    };
                    tokio::select! {
                        () = stop.cancelled() => {}
                        () = session => {}
                    }
                });
            }
            Err(error) => {
                if let Some(left_out) = failures.next(Instant::now()) {
                    tracing::warn!("cannot accept a connection: {error}; retrying{}", more(left_out));
                }
                tokio::time::sleep(ACCEPT_RETRY_DELAY).await;
            }
        }
    }
}

/// A worker that has been admitted.
struct Admitted {
    worker: WorkerId,
    hello: Hello,
    identity: Identity,
    stream: Connection<TcpStream>,
}

/// Shakes hands with a peer. Failures are logged.
async fn shake_hands(
    driver: &Driver,
    stream: TcpStream,
    address: SocketAddr,
    place: &Place,
) -> Option<Admitted> {
    if let Err(error) = tcp::configure(&stream) {
        tracing::debug!("{address}: cannot send small messages at once: {error}");
    }
    let door = &driver.door;
    let delay = door.backoff.delay(address.ip(), Instant::now());
    if !delay.is_zero() {
        tokio::time::sleep(delay).await;
    }
    // A connection that never sends is no news: port scanners and health checks do that.
    if let Err(error) = place.wait_for_first_byte(&stream).await {
        tracing::debug!("{address} sends nothing and is closed: {error}");
        return None;
    }
    let mut admitted = None;
    let decide = |hello: &Hello, key: Option<KeyHash>| {
        let identity = driver.tickets.identify(&hello.name, address.ip(), key);
        match driver.refusal(&identity) {
            Some(reason) => Err(reason),
            None => Ok(Welcome { worker: admitted.insert((driver.next_worker(), identity)).0.0 }),
        }
    };
    match handshake::as_master(stream, &driver.security, decide).await {
        Ok((stream, hello)) => {
            door.backoff.succeeded(address.ip());
            admitted.map(|(worker, identity)| {
                // A ticket is never displayed.
                let hello = Hello { name: identity.name(), ..hello };
                Admitted { worker, hello, identity, stream }
            })
        }
        // The worker retries every few seconds.
        Err(error @ ProtocolError::NotNow { .. }) => {
            tracing::debug!("{address} is refused: {error}");
            None
        }
        Err(error) => {
            door.backoff.failed(address.ip(), Instant::now());
            door.refusals.log(address, &error);
            None
        }
    }
}

/// Runs a session to its end.
async fn run_session(driver: &Driver, admitted: Admitted, address: SocketAddr) {
    let Admitted { worker, hello, identity, stream } = admitted;
    let Hello { name, threads, simd, software, .. } = hello.clone();
    let left_out = driver.door.log_lines.next(address.ip(), Instant::now());
    if let Some(left_out) = left_out {
        let more = more(left_out);
        tracing::info!("{worker} joins: {name} ({address}), {threads} threads, {simd}, {software}{more}");
    }
    let is_logged = left_out.is_some();
    let (limit, key) = (BodyLimit::closed(driver.receiving.clone()), stream.peer_key());
    let (sender, receiver, traffic) = session::spawn_limited::<_, ToWorker, ToMaster>(stream, limit.clone());
    let (request, requests) = mpsc::channel(MAX_ASSET_REQUESTS);
    let link = Link { address, key, sender: sender.clone(), traffic, pixels: limit };
    driver.join(worker, Session::new(hello, identity, link, is_logged));
    let ended = tokio::select! {
        ended = receive(driver, worker, address, receiver, request) => ended,
        () = send_assets(driver, worker, &sender, requests) => Err(SessionError::Closed),
    };
    match ended {
        Ok(reason) => {
            if is_logged {
                tracing::info!("{worker} ({name}, {address}) leaves: {reason}");
            }
            driver.leave(worker, "disconnected in order");
        }
        Err(error) => {
            // A session that the driver has ended is logged already.
            if is_logged && driver.is_connected(worker) {
                tracing::warn!("{worker} ({name}, {address}) is lost: {error}");
            }
            driver.leave(worker, &error.to_string());
        }
    }
}

/// Handles a worker's messages. Returns the reason in its disconnect message.
///
/// # Errors
/// The connection fails, or a message breaks a rule.
async fn receive(
    driver: &Driver,
    worker: WorkerId,
    address: SocketAddr,
    mut receiver: Receiver<ToMaster>,
    request: mpsc::Sender<(AssetId, u64)>,
) -> Result<String, SessionError> {
    let mut budget = Budget::new(Instant::now());
    let mut times_replaced = driver.assets.times_replaced();
    let mut has_delivered = false;
    while let Some(message) = receiver.recv().await {
        let message = message?;
        let has_asset = |id| driver.assets.has(id);
        if std::mem::replace(&mut times_replaced, driver.assets.times_replaced()) != times_replaced {
            budget.scene_replaced(has_asset);
        }
        budget.count(&message, has_asset, Instant::now())?;
        match message {
            ToMaster::Pixels { header, bytes } => {
                driver.pixels(worker, header, &bytes)?;
                if !has_delivered {
                    has_delivered = true;
                    driver.door.add_known(address.ip());
                }
            }
            ToMaster::NeedAsset { id, offset, again } => {
                if !driver.asset_requested(worker, id, offset, again) {
                    request.try_send((id, offset)).map_err(|_| SessionError::TooManyRequests)?;
                }
            }
            ToMaster::Sharing { port } => driver.add_peer_server(worker, port),
            ToMaster::HaveAsset { id } => driver.asset_received(worker, id),
            ToMaster::Pong { nonce, progressed } => {
                driver.pong(worker, nonce, progressed)?;
            }
            ToMaster::Failed { frame, reason } => driver.failed(worker, frame, reason)?,
            ToMaster::Drain => driver.handle(Event::WorkerDrains { worker }),
            ToMaster::Disconnect { reason } => return Ok(reason),
        }
    }
    Err(SessionError::Closed)
}

/// Sends the assets that a worker requests, one after the other, as fast as it reads them. Ends with the session.
async fn send_assets(
    driver: &Driver,
    worker: WorkerId,
    sender: &Sender<ToWorker>,
    mut requests: mpsc::Receiver<(AssetId, u64)>,
) {
    while let Some((id, offset)) = requests.recv().await {
        let sent = match driver.assets.get(id) {
            Some(bytes) => send_asset(driver, worker, sender, id, bytes, offset).await,
            None => sender.send(ToWorker::AssetUnknown { id }).await,
        };
        match sent {
            Ok(()) => {}
            // The receiving half of the session reports why it has ended.
            Err(SendError::Closed) => return std::future::pending().await,
            Err(SendError::Invalid(error)) => tracing::error!("asset {id} cannot be sent: {error}"),
        }
    }
}

/// Sends an asset from byte `offset` on.
async fn send_asset(
    driver: &Driver,
    worker: WorkerId,
    sender: &Sender<ToWorker>,
    id: AssetId,
    mut bytes: Bytes,
    mut offset: u64,
) -> Result<(), SendError> {
    sender.send(ToWorker::AssetBegin { id, size: bytes.len() as u64 }).await?;
    // An offset beyond the end leaves nothing to send.
    let _ = bytes.split_to(usize::try_from(offset).unwrap_or(usize::MAX).min(bytes.len()));
    while !bytes.is_empty() {
        let chunk = bytes.split_to(bytes.len().min(MAX_CHUNK_BYTES));
        let next = offset + chunk.len() as u64;
        sender.send(ToWorker::AssetChunk { id, offset, bytes: chunk }).await?;
        offset = next;
        // On a slow link, pings wait behind megabytes in the operating system's buffers: this report counts as a sign of life.
        driver.asset_sent(worker, id, offset);
    }
    Ok(())
}
