//! The farm: ask for frames, get pictures. Everything that happens in between is below this file.
//!
//! ```text
//! let mut farm = Farm::start(options, scene).await?;
//! farm.request(view);
//! let frame = farm.finished().await?;
//! farm.shut_down().await;
//! ```
//!
//! A frame begins when no earlier one stands in its way. Callers that keep at most two requests open (the one being
//! rendered and the one after it) get every frame they asked for, in order. A third open request replaces the second
//! unless half of that one is leased already, so a moving camera never queues up, and the oldest frame is always
//! finished. Frames may differ in size; one of another size than the one before begins when that is complete.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;

use rayfarm_protocol::FrameId;
use rayfarm_tracer::scene::FrameView;
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio_util::sync::{CancellationToken, DropGuard};
use tokio_util::task::TaskTracker;

use crate::accounting::TraceSink;
use crate::assets::Assets;
use crate::control::FarmControl;
use crate::driver::Driver;
use crate::error::FarmError;
use crate::finished::FinishedFrame;
use crate::options::{DEFAULT_PORT, FarmOptions, FarmScene};
use crate::server;
use crate::sessions::addresses::Reachable;
use crate::status::FarmStatus;
use crate::supervisor::{LocalWorkers, Places};
use crate::verification::arbiter::{self, Trace};
use crate::verification::delivered::FrameSet;

/// A running farm. Dropped without [`Farm::shut_down`], it ends its sessions and its local workers all the same,
/// only without waiting for them.
pub struct Farm {
    address: SocketAddr,
    driver: Arc<Driver>,
    places: Arc<Places>,
    sessions: TaskTracker,
    processes: TaskTracker,
    stop_processes: CancellationToken,
    stop: DropGuard,
}

impl Farm {
    /// Binds the listening address, starts the local workers and waits for requests.
    ///
    /// # Errors
    /// [`FarmError::Listen`] when the address is taken or does not belong to this machine, [`FarmError::Assets`]
    /// when the scene cannot be sent, [`FarmError::Random`] when segments are to be verified and cannot be drawn.
    pub async fn start(options: FarmOptions, scene: FarmScene) -> Result<Farm, FarmError> {
        let stop = CancellationToken::new();
        let trace = (options.verify_percent > 0).then(|| arbiter::tracer(scene.clone(), stop.clone()));
        Self::start_with(options, scene, trace, stop).await
    }

    /// As [`Farm::start`], with whoever traces rows for the master itself.
    pub(crate) async fn start_with(
        options: FarmOptions,
        scene: FarmScene,
        trace: Option<Arc<Trace>>,
        stop: CancellationToken,
    ) -> Result<Farm, FarmError> {
        let assets = Assets::new(&scene.scene, scene.meshes, scene.textures)?;
        let (listener, address) = listen(options.listen).await?;
        if let Some(line) = Reachable::of(address).announcement() {
            tracing::info!("{line}");
        }
        let (court, cases) = mpsc::unbounded_channel();
        let driver = Arc::new(Driver::new(&options, assets, court)?);
        let (sessions, processes) = (TaskTracker::new(), TaskTracker::new());

        let clock = driver.clone();
        let stopped = stop.clone();
        tokio::spawn(async move { clock.keep_time(stopped).await });
        if let Some(trace) = trace {
            let referee = driver.clone();
            let settle = move |event| referee.handle(event);
            tokio::spawn(arbiter::hold_court(cases, trace, settle, stop.clone()));
        }
        tokio::spawn(server::accept(listener, driver.clone(), sessions.clone(), stop.clone()));
        let local = LocalWorkers {
            command: options.local_worker.clone(),
            count: options.local_workers,
            threads: options.threads,
            listening: address,
        };
        let bereaved = driver.clone();
        let stop_processes = stop.child_token();
        let places = local.start(&driver.tickets, &processes, &stop_processes, move |reason| {
            if bereaved.worker_count() == 0 {
                bereaved.report(FarmError::NoWorkers { reason, address });
            }
        });
        Ok(Farm { address, driver, places, sessions, processes, stop_processes, stop: stop.drop_guard() })
    }

    /// Where workers connect.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The frame to render next; see the top of this file for what becomes of earlier requests. A frame that cannot
    /// be rendered at all (no pixels, a camera that sees nothing) is an error of [`Farm::finished`].
    pub fn request(&self, view: FrameView) -> FrameId {
        self.driver.request(view)
    }

    /// How many frames the run has: [`FarmStatus::totals`] tells how long they take.
    pub fn expect_frames(&self, frames: u64) {
        self.driver.expect_frames(frames);
    }

    /// Gives up all frames that were requested so far, begun or not: they will not be finished.
    pub fn give_up(&self) {
        self.driver.give_up();
    }

    /// The next completed frame, in the order of requests. Waits for as long as it takes. Safe to drop half-way, as
    /// `select!` does.
    ///
    /// # Errors
    /// [`FarmError::View`] for a request that cannot be rendered, [`FarmError::Refused`] for one that all workers say
    /// they cannot; [`FarmError::NoWorkers`], once, when nobody is
    /// left to render: a worker that connects later goes on with the frame.
    pub async fn finished(&mut self) -> Result<FinishedFrame, FarmError> {
        self.driver.next_finished().await
    }

    /// Waits until nothing is left to verify of the frames that are complete. Safe to drop half-way.
    pub async fn verified(&self) {
        self.driver.all_verified().await;
    }

    /// Finished frames that have rows of workers which were found to send wrong pixels: they may be wrong.
    pub fn wrong_frames(&self) -> FrameSet {
        self.driver.wrong_frames()
    }

    /// What is going on right now.
    pub fn status(&self) -> FarmStatus {
        FarmStatus { local_gone: self.places.gone(), ..self.driver.status() }
    }

    /// Another handle, for whoever steers the farm beside the one who asks for frames. Call it inside the runtime.
    pub fn control(&self) -> FarmControl {
        FarmControl::new(self.driver.clone(), self.places.clone())
    }

    /// Tells a timeline of everything from now on.
    pub fn trace_into(&self, sink: TraceSink) {
        self.driver.trace_into(sink);
    }

    /// Says goodbye to all workers and waits, not for long, until the local ones have ended; kills what has not.
    pub async fn shut_down(self) {
        // First of all, so that nobody starts a worker again that ends because it was told goodbye.
        self.stop_processes.cancel();
        self.driver.part("the master ends").await;
        let stop = self.stop.disarm();
        stop.cancel();
        for tasks in [self.processes, self.sessions] {
            tasks.close();
            tasks.wait().await;
        }
    }
}

/// Binds the address asked for, or else the usual one, or else whatever is free.
async fn listen(asked: Option<SocketAddr>) -> Result<(TcpListener, SocketAddr), FarmError> {
    let usual = SocketAddr::from((Ipv4Addr::LOCALHOST, DEFAULT_PORT));
    let address = asked.unwrap_or(usual);
    let bound = match TcpListener::bind(address).await {
        Err(error) if asked.is_none() && error.kind() == ErrorKind::AddrInUse => {
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
