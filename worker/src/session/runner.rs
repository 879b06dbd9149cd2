//! Runner of a session: performs the effects of [`SessionState`]. Long work runs on render threads or blocking threads, so
//! that a ping is answered at once.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_protocol::session::{self, Receiver, SendError, Sender, Traffic};
use rayfarm_protocol::{Reconnect, ToMaster, ToWorker};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval};

use super::idle_timeout::{CHECK_INTERVAL, IdleTimeout};
use super::state::{Effect, SessionState, Work, WorkResult};
use super::work::{compile_with_permit, do_work};
use crate::peer::{Fetch, PeerClient, PeerEvent, PeerServer, StallClock};
use crate::render_pool::{JobReply, PoolJob, RenderPool};
use crate::renderer::Renderer;
use crate::scenes::{BuildPool, DiskWriter, SceneLoader, SceneWork};
use crate::shutdown::ShutdownHandle;

/// Capacity of the channel from the render threads to the pixel sender, in segments.
const PIXEL_QUEUE: usize = 8;

/// Capacity of the channel from the transfers of other workers, in chunks.
const PEER_EVENT_QUEUE: usize = 8;

/// Most pieces of blocking work at a time. While there are that many, the session reads no messages.
const MAX_WORK: usize = 64;

/// Most leases that are queued or being rendered at a time.
const MAX_LEASES: usize = 4096;

/// Time limit to send the disconnect.
const DISCONNECT_LIMIT: Duration = Duration::from_millis(800);

/// State of a worker that persists across sessions.
pub(crate) struct PersistentState<R: Renderer> {
    pub(crate) renderer: Arc<R>,
    pub(crate) pool: RenderPool<R>,
    pub(crate) builders: BuildPool,
    pub(crate) loader: SceneLoader<R>,
    pub(crate) disk: Option<DiskWriter>,
}

/// Settings of a session, which depend on where the master runs.
#[derive(Clone, Debug)]
pub(crate) struct SessionConfig {
    /// Whether pixels are compressed where that makes them fewer bytes.
    pub(crate) compress: bool,
    /// Whether the disk cache is used.
    pub(crate) uses_disk: bool,
    /// The server of assets for other workers, if any.
    pub(crate) peer_server: Option<PeerServer>,
    /// How assets are fetched from other workers.
    pub(crate) peer_client: PeerClient,
    /// Largest pixels of a segment that are rendered, in bytes; `None` for the bound of the protocol.
    pub(crate) max_segment_bytes: Option<usize>,
}

/// End of a session.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum SessionEnd {
    /// The master disconnected for good, for this reason.
    Disconnected(String),
    /// The master itself ended, for this reason. Another one may listen at its address later.
    MasterEnded(String),
    /// All leases are done and no more will follow.
    Drained,
    /// The worker was stopped.
    Stopped,
    /// The connection failed, or the master requested a new one.
    Lost(String),
}

/// Runs a session until the master or the worker ends it. Sends a disconnect where the worker ends it.
pub(crate) async fn run_session<R, S>(
    io: S,
    config: SessionConfig,
    persistent: &mut PersistentState<R>,
    shutdown: &ShutdownHandle,
) -> SessionEnd
where
    R: Renderer,
    S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
{
    let (sender, receiver, traffic) = session::spawn(io);
    let PersistentState { renderer, pool, builders, loader, disk } = persistent;
    let disk = disk.as_ref().filter(|_| config.uses_disk);
    let mut state = SessionState::new(&mut *loader, disk.is_some(), config.peer_server.is_some());
    if let Some(bytes) = config.max_segment_bytes {
        state.limit_segments(bytes);
    }
    let runner = SessionRunner {
        renderer,
        pool,
        builders,
        disk,
        state,
        sender: sender.clone(),
        work: JoinSet::new(),
        fetches: JoinSet::new(),
        stall_clock: config
            .peer_server
            .as_ref()
            .map_or_else(Arc::default, |it| it.cache.stall_clock().clone()),
        peer_server: config.peer_server,
        peer_client: config.peer_client,
        compress: config.compress,
        shutdown,
        traffic,
    };
    let end = tokio::select! {
        biased;
        () = shutdown.stopped() => SessionEnd::Stopped,
        end = runner.run(receiver) => end,
    };
    pool.cancel(|_| true);
    // Cancels compilations in progress.
    loader.reset(false, false);
    disconnect(&sender, &end).await;
    end
}

/// Sends a disconnect where this worker ends the session, and closes the connection.
async fn disconnect(sender: &Sender<ToMaster>, end: &SessionEnd) {
    let reason = match end {
        SessionEnd::Stopped => Some("this worker was stopped"),
        SessionEnd::Drained => Some("all its segments are done"),
        SessionEnd::Disconnected(_) | SessionEnd::MasterEnded(_) | SessionEnd::Lost(_) => None,
    };
    if let Some(reason) = reason {
        let message = ToMaster::Disconnect { reason: reason.to_owned() };
        let disconnect = async {
            if sender.send(message).await.is_ok() {
                sender.closed().await;
            }
        };
        // A master that does not read detects the closed connection.
        let _ = tokio::time::timeout(DISCONNECT_LIMIT, disconnect).await;
    }
    sender.abort();
}

struct SessionRunner<'a, R: Renderer> {
    renderer: &'a Arc<R>,
    pool: &'a RenderPool<R>,
    builders: &'a BuildPool,
    disk: Option<&'a DiskWriter>,
    state: SessionState<'a, R>,
    sender: Sender<ToMaster>,
    /// Blocking work. The result is `None` where it was cancelled.
    work: JoinSet<Option<WorkResult<R>>>,
    /// Transfers from other workers.
    fetches: JoinSet<()>,
    peer_server: Option<PeerServer>,
    peer_client: PeerClient,
    /// Chunks of assets that arrive in this session.
    stall_clock: Arc<StallClock>,
    compress: bool,
    shutdown: &'a ShutdownHandle,
    traffic: Arc<Traffic>,
}

impl<R: Renderer> SessionRunner<'_, R> {
    async fn run(mut self, mut receiver: Receiver<ToWorker>) -> SessionEnd {
        let (pixels, finished) = mpsc::channel(PIXEL_QUEUE);
        let (failures, mut failed) = mpsc::unbounded_channel();
        // Dropped to drain: the pixel sender ends after the last lease.
        let mut reply = Some(JobReply { pixels, failures, compress: self.compress });
        let mut pixel_sender = JoinSet::new();
        pixel_sender.spawn(send_pixels(finished, self.sender.clone()));
        let (peer_events, mut peer_event) = mpsc::channel(PEER_EVENT_QUEUE);
        if let Some(PeerServer { port, cache }) = &self.peer_server {
            cache.reset();
            self.send(ToMaster::Sharing { port: *port }).await;
        }
        let mut draining = false;
        let mut has_requested_drain = false;
        let (mut idle, mut checks) = (IdleTimeout::default(), interval(CHECK_INTERVAL));
        checks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            while let Some(effect) = self.state.poll_effect() {
                match effect {
                    Effect::Drain => draining = true,
                    Effect::End { reason, reconnect } => {
                        return end_of_session(reason, reconnect, has_requested_drain, draining);
                    }
                    Effect::Pong(nonce) => {
                        let progressed = self.pool.progress().take();
                        self.send(ToMaster::Pong { nonce, progressed }).await;
                    }
                    Effect::Send(message) => {
                        if let (ToMaster::NeedAsset { id, .. }, Some(server)) = (&message, &self.peer_server)
                        {
                            server.cache.expect(*id);
                        }
                        self.send(message).await;
                    }
                    effect => {
                        if let Err(why) = self.perform(effect, reply.as_ref(), &peer_events) {
                            return SessionEnd::Lost(why);
                        }
                    }
                }
            }
            if draining && !self.state.has_waiting_leases() {
                reply = None;
            }
            tokio::select! {
                message = receiver.recv(), if self.work.len() < MAX_WORK => match message {
                    Some(Ok(message)) => {
                        if matches!(message, ToWorker::AssetChunk { .. }) {
                            self.stall_clock.note_chunk();
                        }
                        self.state.handle_message(Instant::now(), message);
                    }
                    Some(Err(error)) => return SessionEnd::Lost(error.to_string()),
                    None => {
                        let why = "the master closed the connection without a disconnect";
                        return SessionEnd::Lost(why.to_owned());
                    }
                },
                Some(result) = self.work.join_next() => match result {
                    Ok(Some(result)) => self.state.handle_result(result),
                    Ok(None) => {}
                    // Panics are caught and tasks are not aborted, so the runtime shuts down.
                    Err(error) => tracing::debug!("work was not finished: {error}"),
                },
                Some(event) = peer_event.recv() => self.state.handle_peer_event(event),
                Some(_) = self.fetches.join_next() => {}
                Some((frame, reason)) = failed.recv() => self.state.fail_frame(frame, reason),
                Some(_) = pixel_sender.join_next(), if reply.is_none() => return SessionEnd::Drained,
                () = self.shutdown.draining(), if !has_requested_drain => {
                    has_requested_drain = true;
                    // The master leases no more, and disconnects when it has received the remaining pixels.
                    self.send(ToMaster::Drain).await;
                }
                // While the session does not read, the idle timeout is paused.
                _ = checks.tick(), if self.work.len() < MAX_WORK => {
                    if let Some(server) = &self.peer_server {
                        server.cache.evict(Instant::now());
                    }
                    if idle.has_expired(self.traffic.received_bytes()) {
                        return SessionEnd::Lost(IdleTimeout::reason());
                    }
                }
            }
        }
    }

    /// Performs an effect that needs no waiting.
    ///
    /// # Errors
    /// The reason to end the session: too many leases.
    fn perform(
        &mut self,
        effect: Effect<R>,
        reply: Option<&JobReply>,
        peer_events: &mpsc::Sender<PeerEvent>,
    ) -> Result<(), String> {
        match effect {
            Effect::Work(work) => self.spawn_work(work),
            Effect::Save(id, bytes) => {
                if let Some(disk) = self.disk {
                    disk.save(id, bytes);
                }
            }
            Effect::FetchFromPeer { id, size, source } => {
                let (client, clock) = (self.peer_client.clone(), Arc::clone(&self.stall_clock));
                let fetch = Fetch { id, size, source };
                self.fetches.spawn(client.fetch(fetch, clock, peer_events.clone()));
            }
            Effect::Serve(id, asset) => {
                if let Some(server) = &self.peer_server {
                    server.cache.insert(id, asset);
                }
            }
            Effect::SetShareKey { generation, key } => {
                if let Some(server) = &self.peer_server {
                    server.cache.set_key(generation, key);
                }
            }
            Effect::Render { lease, rows, frame, arrived } => {
                let Some(reply) = reply else {
                    tracing::warn!("the master leases {lease} after it announced a drain; it is ignored");
                    return Ok(());
                };
                if self.pool.len() >= MAX_LEASES {
                    return Err(format!("the master leases more than {MAX_LEASES} segments at a time"));
                }
                self.pool.submit(PoolJob::<R>::new(lease, rows, frame, reply.clone(), arrived));
            }
            Effect::CancelBefore(before) => self.pool.cancel(|frame| frame < before),
            Effect::CancelFrame(stale) => self.pool.cancel(|frame| frame == stale),
            // The caller has handled these.
            Effect::Send(_) | Effect::Pong(_) | Effect::Drain | Effect::End { .. } => {}
        }
        Ok(())
    }

    fn spawn_work(&mut self, work: Work<R>) {
        let renderer = Arc::clone(self.renderer);
        let builders = self.builders.clone();
        let disk = self.disk.map(|disk| Arc::clone(disk.cache()));
        let progress = self.pool.progress().clone();
        if matches!(work, Work::Scene(SceneWork::Compile { .. })) {
            self.work.spawn(compile_with_permit(renderer, builders, progress, work));
        } else {
            let work = move || do_work(&*renderer, &builders, disk.as_deref(), &progress, work);
            self.work.spawn_blocking(work);
        }
    }

    async fn send(&self, message: ToMaster) {
        match self.sender.send(message).await {
            // The receiver returns the reason for which a session has ended.
            Ok(()) | Err(SendError::Closed) => {}
            Err(SendError::Invalid(error)) => tracing::error!("a message was not sent: {error}"),
        }
    }
}

/// Interprets a disconnect of the master. A worker that has requested a drain has no reason to return; one that was
/// drained by the master is not to wait for the next master.
fn end_of_session(
    reason: String,
    reconnect: Reconnect,
    has_requested_drain: bool,
    draining: bool,
) -> SessionEnd {
    match reconnect {
        Reconnect::Now if !has_requested_drain => {
            SessionEnd::Lost(format!("the master ended the session: {reason}"))
        }
        Reconnect::NextMaster if !has_requested_drain && !draining => SessionEnd::MasterEnded(reason),
        Reconnect::Never | Reconnect::Now | Reconnect::NextMaster => SessionEnd::Disconnected(reason),
    }
}

/// Sends finished segments as fast as the master receives them, so that nothing else waits for the network.
async fn send_pixels(mut finished: mpsc::Receiver<ToMaster>, sender: Sender<ToMaster>) {
    while let Some(pixels) = finished.recv().await {
        match sender.send(pixels).await {
            Ok(()) | Err(SendError::Closed) => {}
            Err(SendError::Invalid(error)) => tracing::error!("a segment was not sent: {error}"),
        }
    }
}
