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
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::{FrameView, Scene};
use rayfarm_tracer::texture::Texture;
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio_util::sync::{CancellationToken, DropGuard};
use tokio_util::task::TaskTracker;

use crate::accounting::TraceSink;
use crate::addresses::Reachable;
use crate::assets::Assets;
use crate::delivered::FrameSet;
use crate::driver::Driver;
use crate::judge::{self, Trace};
use crate::local_workers::{LocalWorkers, Places};
use crate::server;

pub use crate::accounting::{FrameAccount, Parts, SegmentNote, WorkerAccount};
pub use crate::assets::AssetError;
pub use crate::farm_control::FarmControl;
pub use crate::framebuffer::FramePixels;
pub use crate::scheduler::policy::SegmentPolicy;
pub use crate::scheduler::{Verification, WorkerState};
pub use crate::transfers::TransferStatus;
pub use error::{FarmError, UnknownWorker};
pub use rayfarm_protocol::{Cost as FrameCounts, FrameId};

mod error;

/// Where workers connect when nobody says otherwise.
pub const DEFAULT_PORT: u16 = 7117;

/// How a farm is set up.
#[derive(Clone, Debug, Default)]
pub struct FarmOptions {
    /// Where to listen for workers. `None`: 127.0.0.1 at [`DEFAULT_PORT`], or at a free port when that one is
    /// taken. An address that is asked for and taken is an error.
    pub listen: Option<SocketAddr>,
    /// Worker processes to start on this machine, ended with the farm.
    pub local_workers: u32,
    /// Render threads of each local worker; `None` divides the cores among them, at least one each.
    pub threads: Option<usize>,
    /// How frames are cut into segments.
    pub policy: SegmentPolicy,
    /// Whether a frame begins only when the one before it is complete. Otherwise workers that have nothing left to do in
    /// a frame begin the next one: more frames a second, each with an older camera.
    pub sequential: bool,
    /// The share of the segments that a second worker, or the master, renders as well, to find workers that send wrong
    /// pixels; 0 to 100. Which ones is drawn when their pixels have come.
    pub verify_percent: u8,
}

/// What the farm draws.
#[derive(Clone)]
pub struct FarmScene {
    /// The scene as data.
    pub scene: Scene,
    /// The meshes that it names; others are neither kept nor sent.
    pub meshes: Vec<Arc<CompiledMesh>>,
    /// The textures that it names, likewise.
    pub textures: Vec<Arc<Texture>>,
}

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

/// A completed picture and what it took.
#[derive(Debug)]
pub struct FinishedFrame {
    /// Which request this is.
    pub frame: FrameId,
    /// What was asked for.
    pub view: FrameView,
    /// RGB8 sRGB rows, top to bottom: `view.width * view.height * 3` bytes.
    pub pixels: FramePixels,
    /// What the segments of the picture took, summed: nanoseconds of tracing over all threads, and rays by kind.
    /// Each row counts once, however many workers rendered it.
    pub counts: FrameCounts,
    /// From the moment the frame began to its last row.
    pub elapsed: Duration,
    /// From the request to the last row: how old the camera is that the picture shows.
    pub latency: Duration,
    /// Workers connected when it completed.
    pub workers: u32,
    /// Render threads of these workers together.
    pub threads: u32,
    /// Bytes sent to all workers since the frame before.
    pub sent_bytes: u64,
    /// Bytes received from all workers since the frame before.
    pub received_bytes: u64,
    /// The part of `sent_bytes` that describes what to draw: frame announcements and assets.
    pub scene_bytes: u64,
    /// What the workers did with their time since the frame before, and who rendered what.
    pub account: FrameAccount,
}

/// A look at the farm, for overlays and progress bars.
#[derive(Clone, Debug, Default)]
pub struct FarmStatus {
    /// The workers connected now, in the order in which they came.
    pub workers: Vec<WorkerStatus>,
    /// Workers that were kicked and are kept out, in the order in which they were kicked.
    pub kicked: Vec<KickedWorker>,
    /// Local workers that have left, or cannot be kept running: [`FarmControl::bring_back`] starts them again.
    pub local_gone: u32,
    /// The oldest frame being rendered.
    pub frame: Option<FrameId>,
    /// Its finished rows.
    pub rows_done: u32,
    /// Its rows.
    pub rows: u32,
    /// Finished frames that have rows of workers which were found to send wrong pixels: they may be wrong.
    pub wrong_frames: u64,
    /// How much was verified since the farm began, where it verifies at all.
    pub verification: Option<Verification>,
    /// How much of the scene is at the workers that still wait for it.
    pub transfers: TransferStatus,
    /// Sums over the run.
    pub totals: RunTotals,
}

/// A run up to now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RunTotals {
    /// Frames completed.
    pub frames_done: u64,
    /// Frames of the whole run, where that is known.
    pub frames: Option<u64>,
    /// Since the first request.
    pub elapsed: Duration,
    /// Frames a second over the last 20 seconds or so.
    pub fps: f64,
    /// How long the rest takes at that pace, if that is known.
    pub left: Option<Duration>,
    /// Bytes sent to all workers.
    pub sent_bytes: u64,
    /// Bytes received from all workers.
    pub received_bytes: u64,
    /// The part of `sent_bytes` that describes what to draw.
    pub scene_bytes: u64,
}

/// A worker that is kept out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KickedWorker {
    /// The number that it had when it was kicked.
    pub id: u64,
    /// What it calls itself.
    pub name: String,
    /// Where it connected from; `None` for a local worker.
    pub address: Option<IpAddr>,
}

/// A connected worker.
#[derive(Clone, Debug)]
pub struct WorkerStatus {
    /// Number given by this master; never reused.
    pub id: u64,
    /// What it calls itself. Not unique: any worker may choose any name.
    pub name: String,
    /// Whether this master has started it.
    pub local: bool,
    /// Where it connects from.
    pub address: SocketAddr,
    /// Its render threads.
    pub threads: u32,
    /// Segments it has finished since it connected.
    pub segments_done: u64,
    /// Rows of average cost per second, smoothed; 0 before that is known.
    pub speed: f64,
    /// Whether it is given work, and why not.
    pub state: WorkerState,
    /// Why it could not render a frame, the last time it could not.
    pub trouble: Option<String>,
}

impl Farm {
    /// Binds the listening address, starts the local workers and waits for requests.
    ///
    /// # Errors
    /// [`FarmError::Listen`] when the address is taken or does not belong to this machine, [`FarmError::Assets`]
    /// when the scene cannot be sent, [`FarmError::Random`] when segments are to be verified and cannot be drawn.
    pub async fn start(options: FarmOptions, scene: FarmScene) -> Result<Farm, FarmError> {
        // Where even this is not known, the name alone may be found, and the failure to start is reported.
        let program = std::env::current_exe().unwrap_or_else(|_| "rayfarm-master".into());
        Self::start_with_worker_program(options, scene, program).await
    }

    /// As [`Farm::start`], with local workers run from another program; it is given the same arguments.
    ///
    /// # Errors
    /// As [`Farm::start`].
    pub async fn start_with_worker_program(
        options: FarmOptions,
        scene: FarmScene,
        program: PathBuf,
    ) -> Result<Farm, FarmError> {
        let stop = CancellationToken::new();
        let trace = (options.verify_percent > 0).then(|| judge::tracer(scene.clone(), stop.clone()));
        Self::start_with(options, scene, program, trace, stop).await
    }

    /// As [`Farm::start`], with whoever traces rows for the master itself.
    pub(crate) async fn start_with(
        options: FarmOptions,
        scene: FarmScene,
        program: PathBuf,
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
            tokio::spawn(judge::hold_court(cases, trace, driver.clone(), stop.clone()));
        }
        tokio::spawn(server::accept(listener, driver.clone(), sessions.clone(), stop.clone()));
        let local = LocalWorkers {
            program,
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
    pub(crate) fn wrong_frames(&self) -> FrameSet {
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
    pub(crate) fn trace_into(&self, sink: TraceSink) {
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
