//! The farm: ask for frames, get pictures. Everything that happens in between is below this file.
//!
//! ```text
//! let mut farm = Farm::start(options, scene).await?;
//! farm.request(view);
//! let frame = farm.finished().await?;
//! farm.shut_down().await;
//! ```
//!
//! A frame begins when no earlier one stands in its way, and a frame that has begun is always finished: callers
//! that keep at most two requests open (the one being rendered and the one after it) get every frame they asked
//! for, in order. A third open request replaces the second as long as that one has not begun, so a moving camera never queues up.
//! A request of another picture size gives up all earlier ones, begun or not: nobody can show them any more.

use std::net::SocketAddr;
use std::ops::Deref;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::{FrameView, Scene};

pub use crate::scheduler::policy::SegmentPolicy;
pub use rayfarm_protocol::FrameId;

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
}

/// What the farm draws.
pub struct FarmScene {
    /// The scene as data.
    pub scene: Scene,
    /// The meshes that it names; others are neither kept nor sent.
    pub meshes: Vec<Arc<CompiledMesh>>,
}

/// A running farm. Dropped without [`Farm::shut_down`], it ends its sessions and its local workers all the same,
/// only without waiting for them.
pub struct Farm {
    address: SocketAddr,
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
    /// What the segments of the picture took, summed: nanoseconds of tracing and rays by kind.
    pub counts: FrameCounts,
    /// From the moment the frame began to its last row.
    pub elapsed: Duration,
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
}

/// What a frame's segments took. Each row counts once, however many workers rendered it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Time that workers spent tracing, summed, in nanoseconds.
    pub trace_ns: u64,
    /// Primary rays.
    pub primary: u64,
    /// Shadow rays.
    pub shadow: u64,
    /// Rays of reflection and transmission.
    pub secondary: u64,
}

/// The pixels of a finished frame; read them as `&[u8]`.
#[derive(Debug)]
pub struct FramePixels {
    bytes: Vec<u8>,
}

impl FramePixels {
    /// Takes the bytes out, for those who keep the picture.
    pub fn into_vec(self) -> Vec<u8> {
        self.bytes
    }
}

impl Deref for FramePixels {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes
    }
}

/// A look at the farm, for overlays and progress bars.
#[derive(Clone, Debug, Default)]
pub struct FarmStatus {
    /// The workers connected now, in the order in which they came.
    pub workers: Vec<WorkerStatus>,
    /// The oldest frame being rendered.
    pub frame: Option<FrameId>,
    /// Its finished rows.
    pub rows_done: u32,
    /// Its rows.
    pub rows: u32,
}

/// A connected worker.
#[derive(Clone, Debug)]
pub struct WorkerStatus {
    /// Number given by this master; never reused.
    pub id: u64,
    /// What it calls itself.
    pub name: String,
    /// Where it connects from.
    pub address: SocketAddr,
    /// Its render threads.
    pub threads: u32,
    /// Segments it has finished since it connected.
    pub segments_done: u64,
    /// Rows per second, smoothed; 0 before the first segment.
    pub speed: f64,
}

/// Why a farm cannot start or go on.
#[derive(Debug, thiserror::Error)]
pub enum FarmError {
    /// The address cannot be listened on.
    #[error("cannot listen for workers on {address}: {source}; {remedy}")]
    Listen {
        /// What was asked for.
        address: SocketAddr,
        /// What the operating system said.
        source: std::io::Error,
        /// What to do about it.
        remedy: &'static str,
    },
}

impl Farm {
    /// Binds the listening address, starts the local workers and waits for requests.
    ///
    /// # Errors
    /// [`FarmError::Listen`] when the address is taken or does not belong to this machine.
    pub async fn start(options: FarmOptions, _scene: FarmScene) -> Result<Farm, FarmError> {
        let address = options.listen.unwrap_or(SocketAddr::from(([127, 0, 0, 1], DEFAULT_PORT)));
        Ok(Farm { address })
    }

    /// Where workers connect.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The frame to render next; see the top of this file for what becomes of earlier requests.
    pub fn request(&self, _view: FrameView) -> FrameId {
        FrameId(0)
    }

    /// The next completed frame, in the order of requests. Waits for as long as it takes.
    ///
    /// # Errors
    /// When the farm cannot complete frames any more; the message says why and what to do.
    pub async fn finished(&mut self) -> Result<FinishedFrame, FarmError> {
        std::future::pending().await
    }

    /// What is going on right now.
    pub fn status(&self) -> FarmStatus {
        FarmStatus::default()
    }

    /// Says goodbye to all workers and waits, not for long, until the local ones have ended; kills what has not.
    pub async fn shut_down(self) {}
}
