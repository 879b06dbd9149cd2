//! Read-only views of the scheduler for overlays and commands. Decisions never use them.

use std::fmt;
use std::time::Duration;

use super::worker::{Service, Worker};
use super::{FrameId, Scheduler, WorkerId};

/// Record of one worker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkerRecord {
    /// Worker that the record describes.
    pub worker: WorkerId,
    /// Number of segments that the worker has finished.
    pub segments_done: u64,
    /// Speed in rows of average cost per second; 0 before it is measured.
    pub speed: f64,
    /// Whether the worker gets leases, or the reason why not.
    pub state: WorkerState,
}

/// Whether a worker gets leases, or why not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkerState {
    /// It gets leases.
    Working,
    /// It is paused: it finishes its leases and gets no more.
    Paused,
    /// It finishes its leases and is then disconnected.
    Draining,
    /// It could not render a frame or a lease was overdue, and it backs off.
    Resting,
    /// A ping is unanswered: it may be dead.
    Silent,
}

impl fmt::Display for WorkerState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Working => "working",
            Self::Paused => "paused",
            Self::Draining => "draining",
            Self::Resting => "resting",
            Self::Silent => "silent",
        })
    }
}

/// Progress of the oldest frame in flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Frame that the record describes.
    pub frame: FrameId,
    /// Number of finished rows of the frame.
    pub rows_done: u32,
    /// Number of rows of the frame.
    pub rows: u32,
}

impl Worker {
    /// Its state; what users have set takes precedence over its liveness.
    fn state(&self, now: Duration) -> WorkerState {
        match self.service {
            Service::Draining => WorkerState::Draining,
            Service::Paused => WorkerState::Paused,
            Service::Active if self.is_suspect(now) => WorkerState::Silent,
            Service::Active if self.backoff_until(now).is_some() => WorkerState::Resting,
            Service::Active => WorkerState::Working,
        }
    }
}

impl Scheduler {
    /// Records of all workers, in the order in which they joined.
    pub fn workers(&self) -> impl Iterator<Item = WorkerRecord> {
        self.workers.iter().map(|(&worker, known)| WorkerRecord {
            worker,
            segments_done: known.segments_done,
            speed: known.speed.value().unwrap_or(0.0),
            state: known.state(self.handled_at),
        })
    }

    /// Progress of the oldest frame in flight; `None` when none is.
    pub fn progress(&self) -> Option<Progress> {
        let frame = self.frames.front()?;
        Some(Progress { frame: frame.id, rows_done: frame.rows_done, rows: frame.height })
    }
}
