//! What can be seen of the scheduler from outside: for overlays and commands, never for its own decisions.

use std::fmt;
use std::time::Duration;

use super::worker::{Service, Worker};
use super::{FrameId, Scheduler, WorkerId};

/// A worker's record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkerRecord {
    /// Which worker.
    pub worker: WorkerId,
    /// Segments it has finished.
    pub segments_done: u64,
    /// Rows of average cost that it delivers each second; 0 before that is known.
    pub speed: f64,
    /// Whether it is given work, and why not.
    pub state: WorkerState,
}

/// Whether a worker is given work, and why not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkerState {
    /// It is given leases.
    Working,
    /// Somebody at the master wants it to pause: it keeps what it holds and gets nothing more.
    Paused,
    /// It finishes what it holds, and then leaves.
    Draining,
    /// It could not render a frame, and is tried again later.
    Resting,
    /// It leaves a question unanswered, and may be dead.
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

/// How far the oldest frame in flight is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Which frame.
    pub frame: FrameId,
    /// Its finished rows.
    pub rows_done: u32,
    /// Its rows.
    pub rows: u32,
}

impl Worker {
    /// Why it gets no leases, or that it does. What somebody wants comes before what has happened to it.
    fn state(&self, now: Duration) -> WorkerState {
        match self.service {
            Service::Draining => WorkerState::Draining,
            Service::Paused => WorkerState::Paused,
            Service::Active if self.is_suspect(now) => WorkerState::Silent,
            Service::Active if self.rested_at(now).is_some() => WorkerState::Resting,
            Service::Active => WorkerState::Working,
        }
    }
}

impl Scheduler {
    /// Every worker's record, in the order in which they joined.
    pub fn workers(&self) -> impl Iterator<Item = WorkerRecord> {
        self.workers.iter().map(|(&worker, known)| WorkerRecord {
            worker,
            segments_done: known.segments_done,
            speed: known.speed.value().unwrap_or(0.0),
            state: known.state(self.handled_at),
        })
    }

    /// How far the oldest frame in flight is; `None` when there is nothing to render.
    pub fn progress(&self) -> Option<Progress> {
        let frame = self.frames.front()?;
        Some(Progress { frame: frame.id, rows_done: frame.rows_done, rows: frame.height })
    }
}
