//! A running farm.
//!
//! A frame starts when no earlier one blocks it. A caller with at most two open requests (the frame being rendered and
//! its successor) gets every frame that it requests, in order. A third open request replaces the second unless half of that
//! one is leased already, so the requests of a moving camera never queue up, and the oldest frame is always finished. Frames
//! may differ in size; a frame whose size differs from its predecessor's starts when that one is complete. The scene may be
//! replaced between two requests: each frame shows the scene of the time of its request.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;

use rayfarm_protocol::FrameId;
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio_util::sync::{CancellationToken, DropGuard};
use tokio_util::task::TaskTracker;

use crate::accounting::TimelineSink;
use crate::assets::Assets;
use crate::assets::scene_table::SceneTable;
use crate::control::FarmControl;
use crate::driver::Driver;
use crate::error::FarmError;
use crate::farm_scene::FarmScene;
use crate::finished::FinishedFrame;
use crate::options::{DEFAULT_PORT, FarmOptions};
use crate::server;
use crate::sessions::addresses::{Entrance, Reachable};
use crate::status::FarmStatus;
use crate::supervisor::{LocalSlots, LocalWorkers};
use crate::verification::arbiter::{self, RowRenderer};
use crate::verification::delivered::FrameSet;
use crate::view_request::ViewRequest;

/// A running farm. Dropping it ends its sessions and local workers without waiting for them; [`Farm::shut_down`] waits.
pub struct Farm {
    address: SocketAddr,
    driver: Arc<Driver>,
    slots: Arc<LocalSlots>,
    sessions: TaskTracker,
    processes: TaskTracker,
    stop_processes: CancellationToken,
    stop: DropGuard,
}

impl Farm {
    /// Starts a farm: binds the listening address and starts the local workers.
    ///
    /// # Errors
    /// [`FarmError::Listen`] when the address is taken or does not belong to this machine, [`FarmError::Assets`]
    /// when the scene cannot be sent, [`FarmError::Random`] when segments are to be verified and the system gives no random
    /// numbers.
    pub async fn start(options: FarmOptions, scene: FarmScene) -> Result<Farm, FarmError> {
        let stop = CancellationToken::new();
        let scenes = Arc::new(SceneTable::new(Arc::new(Assets::new(scene)?)));
        let renderer =
            (options.verify_percent > 0).then(|| arbiter::row_renderer(scenes.clone(), stop.clone()));
        Self::start_with(options, scenes, renderer, stop).await
    }

    /// As [`Farm::start`], with a given renderer for the arbiter.
    pub(crate) async fn start_with(
        options: FarmOptions,
        scenes: Arc<SceneTable>,
        renderer: Option<Arc<RowRenderer>>,
        stop: CancellationToken,
    ) -> Result<Farm, FarmError> {
        let (listener, address) = listen(options.listen).await?;
        if let Some(line) = Reachable::of(address).announcement() {
            tracing::info!("{line}");
        }
        let (arbiter_queue, disputes) = mpsc::unbounded_channel();
        let driver = Arc::new(Driver::new(&options, scenes, arbiter_queue)?);
        let (sessions, processes) = (TaskTracker::new(), TaskTracker::new());

        let clock = driver.clone();
        let stopped = stop.clone();
        tokio::spawn(async move { clock.keep_time(stopped).await });
        let (keys, stopped) = (driver.clone(), stop.clone());
        tokio::spawn(async move { keys.keep_share_keys_new(stopped).await });
        let (revoking, stopped) = (driver.clone(), stop.clone());
        tokio::spawn(async move { revoking.end_revoked(stopped).await });
        if let Some(renderer) = renderer {
            let settled = driver.clone();
            let report = move |event| settled.handle(event);
            tokio::spawn(arbiter::run(disputes, renderer, report, stop.clone()));
        }
        tokio::spawn(server::accept(listener, driver.clone(), sessions.clone(), stop.clone()));
        let local = LocalWorkers {
            command: options.local_worker.clone(),
            count: options.local_workers,
            threads: options.threads,
            entrance: Entrance { address, security: options.security.clone() },
        };
        let reporter = driver.clone();
        let stop_processes = stop.child_token();
        let slots = local.start(&driver.tickets, &processes, &stop_processes, move |reason| {
            if reporter.worker_count() == 0 {
                reporter.report(FarmError::NoWorkers { reason, address });
            }
        });
        Ok(Farm { address, driver, slots, sessions, processes, stop_processes, stop: stop.drop_guard() })
    }

    /// The address where workers connect.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Where and how workers connect.
    pub fn entrance(&self) -> Entrance {
        Entrance { address: self.address, security: self.driver.security.clone() }
    }

    /// Requests a frame. It may replace an earlier request: at most two are open, and the oldest frame is always finished.
    /// A view that cannot be rendered (no pixels, an invalid camera) is an error of [`Farm::finished`].
    pub fn request(&self, request: impl Into<ViewRequest>) -> FrameId {
        self.driver.request(request.into())
    }

    /// Replaces the scene for all frames that are requested from now on. Frames in flight show the scene of their request.
    /// Workers fetch the new scene body when the first frame of it is announced, and only those of its meshes and textures
    /// that they do not have.
    pub fn replace_scene(&self, scene: Arc<Assets>) {
        self.driver.replace_scene(scene);
    }

    /// Sets the number of frames of the run, from which [`FarmStatus::totals`] predicts its duration.
    pub fn expect_frames(&self, frames: u64) {
        self.driver.expect_frames(frames);
    }

    /// Drops all frames that were requested so far, started or not: they are not finished.
    pub fn drop_requests(&self) {
        self.driver.drop_requests();
    }

    /// Waits for the next completed frame, in the order of requests. Cancel safe.
    ///
    /// # Errors
    /// [`FarmError::View`] for a view that cannot be rendered, [`FarmError::Refused`] for a frame that all workers refuse;
    /// [`FarmError::NoWorkers`], once, when the last worker has left: a worker that connects later continues the frame.
    pub async fn finished(&mut self) -> Result<FinishedFrame, FarmError> {
        self.driver.next_finished().await
    }

    /// Waits until no segment of the completed frames is left to verify. Cancel safe.
    pub async fn verified(&self) {
        self.driver.all_verified().await;
    }

    /// Finished frames that have rows of workers which sent wrong pixels: they may be wrong.
    pub fn wrong_frames(&self) -> FrameSet {
        self.driver.wrong_frames()
    }

    /// The current status.
    pub fn status(&self) -> FarmStatus {
        FarmStatus { local_exited: self.slots.empty(), ..self.driver.status() }
    }

    /// A second handle, for commands to workers. Call it inside the runtime.
    pub fn control(&self) -> FarmControl {
        FarmControl::new(self.driver.clone(), self.slots.clone())
    }

    /// Records a timeline of everything from now on.
    pub fn record_timeline(&self, sink: TimelineSink) {
        self.driver.record_timeline(sink);
    }

    /// The hash of the current scene's body.
    #[cfg(test)]
    pub(crate) fn scene_id(&self) -> rayfarm_protocol::AssetId {
        self.driver.assets.current()
    }

    /// Sets a function that is called at the start of each decoding of pixels.
    #[cfg(test)]
    pub(crate) fn on_decode(&self, hook: impl Fn() + Send + Sync + 'static) {
        self.driver.on_decode(hook);
    }

    /// Gives each worker that serves assets a new key.
    #[cfg(test)]
    pub(crate) fn renew_share_keys(&self) {
        self.driver.renew_share_keys();
    }

    /// Disconnects all workers and waits until the local ones have exited; those that do not within three seconds are killed.
    pub async fn shut_down(self) {
        // First of all, so that no supervisor restarts a worker that exits because of its disconnect message.
        self.stop_processes.cancel();
        self.driver.disconnect_all("the master ends").await;
        let stop = self.stop.disarm();
        stop.cancel();
        for tasks in [self.processes, self.sessions] {
            tasks.close();
            tasks.wait().await;
        }
    }
}

/// Binds the requested address, or else the default one, or else a free port.
async fn listen(requested: Option<SocketAddr>) -> Result<(TcpListener, SocketAddr), FarmError> {
    let default = SocketAddr::from((Ipv4Addr::LOCALHOST, DEFAULT_PORT));
    let address = requested.unwrap_or(default);
    let bound = match TcpListener::bind(address).await {
        Err(error) if requested.is_none() && error.kind() == ErrorKind::AddrInUse => {
            let free = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await;
            if let Some(port) = free.as_ref().ok().and_then(|listener| listener.local_addr().ok()) {
                tracing::info!("port {DEFAULT_PORT} is taken; workers connect to {port} instead");
            }
            free
        }
        bound => bound,
    };
    let found = bound.and_then(|listener| listener.local_addr().map(|address| (listener, address)));
    found.map_err(|source| FarmError::Listen { address, source })
}
