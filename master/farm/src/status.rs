//! The status of a running farm.

use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

use rayfarm_protocol::FrameId;
use rayfarm_scheduler::{Verification, WorkerState};

use crate::assets::TransferStatus;

/// A snapshot of the farm, for overlays and progress bars.
#[derive(Clone, Debug, Default)]
pub struct FarmStatus {
    /// The connected workers, in the order in which they connected.
    pub workers: Vec<WorkerStatus>,
    /// Banned workers, oldest ban first.
    pub banned: Vec<BannedWorker>,
    /// Local workers that have exited and are not restarted until [`FarmControl::allow_all`](crate::FarmControl::allow_all).
    pub local_exited: u32,
    /// The oldest frame that is being rendered.
    pub frame: Option<FrameId>,
    /// Finished rows of that frame.
    pub rows_done: u32,
    /// Rows of that frame.
    pub rows: u32,
    /// Finished frames that have rows of workers which sent wrong pixels: they may be wrong.
    pub wrong_frames: u64,
    /// Counts of verified segments since the farm started; `None` where nothing is verified.
    pub verification: Option<Verification>,
    /// Progress of the scene's transfer to the workers that wait for it.
    pub transfers: TransferStatus,
    /// Connections in their handshake.
    pub pending: usize,
    /// Connections that were closed in their handshake, or not looked at, because others took their places.
    pub refused: u64,
    /// Sums over the run.
    pub totals: RunTotals,
}

/// Sums over a run, up to now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RunTotals {
    /// Completed frames.
    pub frames_done: u64,
    /// Frames of the whole run, where known.
    pub frames: Option<u64>,
    /// Time since the first request.
    pub elapsed: Duration,
    /// Frames per second, averaged over about 20 seconds.
    pub fps: f64,
    /// Predicted time for the remaining frames at that rate, where known.
    pub left: Option<Duration>,
    /// Bytes sent to all workers.
    pub sent_bytes: u64,
    /// Bytes received from all workers.
    pub received_bytes: u64,
    /// The part of `sent_bytes` that describes what to draw: frame announcements and assets.
    pub scene_bytes: u64,
}

/// A banned worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BannedWorker {
    /// Number of the worker in its last session.
    pub id: u64,
    /// Name of the worker.
    pub name: String,
    /// Address from which the worker connected; `None` for a local worker.
    pub address: Option<IpAddr>,
}

/// A connected worker.
#[derive(Clone, Debug)]
pub struct WorkerStatus {
    /// Number assigned by this master; never reused.
    pub id: u64,
    /// Name of the worker. Not unique: any worker may choose any name.
    pub name: String,
    /// Whether this master has started it.
    pub local: bool,
    /// The address from which it connects.
    pub address: SocketAddr,
    /// Its render threads.
    pub threads: u32,
    /// Segments that it has finished since it connected.
    pub segments_done: u64,
    /// Rows of average cost per second, smoothed; 0 until it is measured.
    pub speed: f64,
    /// Whether it is granted leases, and if not, why.
    pub state: WorkerState,
    /// Why it last failed to render a frame.
    pub last_failure: Option<String>,
}
