//! A look at a running farm.

use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

use rayfarm_protocol::FrameId;
use rayfarm_scheduler::{Verification, WorkerState};

use crate::assets::TransferStatus;

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
