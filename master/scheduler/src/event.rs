//! Input of the scheduler: events.

use std::fmt;

use super::{ArbiterResult, Cost, Finding, FrameId, Lease};

/// Number of a connected worker. The shell assigns it and never reuses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorkerId(pub u64);

impl fmt::Display for WorkerId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "worker {}", self.0)
    }
}

/// Machine that a worker runs on, as far as the shell can determine. Where a worker of another host is ready, workers of one
/// host do not verify each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct HostId(pub u128);

/// Event that the shell reports. The scheduler ignores events of unknown workers and of frames that are over, so the shell
/// need not track either.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A frame is requested. Frame numbers increase from request to request.
    FrameRequested {
        /// Its number.
        frame: FrameId,
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes of the pixels of a row; leases are as small as the scheduler's limit of bytes makes them.
        row_bytes: u64,
        /// Rows of a tile band; bands begin at multiples of it. Cutting a band adds cost.
        tile_rows: u32,
    },
    /// All frames before `next` are dropped: they are no longer requested.
    RequestsDropped {
        /// The first frame number that is not dropped; that frame need not be requested yet.
        next: FrameId,
    },
    /// A session is ready for leases.
    WorkerJoined {
        /// The new worker.
        worker: WorkerId,
        /// Its render threads: the first estimate of its speed.
        threads: u32,
        /// The machine that it runs on.
        host: HostId,
        /// Whether the shell vouches for it: the master has started it, or it has proved a token with a key of its own.
        trusted: bool,
    },
    /// The master's user lifts the ban of a worker of this machine.
    BanLifted {
        /// The machine.
        host: HostId,
    },
    /// A session has ended, for whatever reason.
    WorkerLeft {
        /// The worker of that session.
        worker: WorkerId,
    },
    /// A worker drains: it finishes its leases and takes no more.
    WorkerDrains {
        /// The draining worker.
        worker: WorkerId,
    },
    /// The master's user drains a worker. The worker is notified, and disconnected once it holds no lease.
    DrainRequested {
        /// The worker to drain.
        worker: WorkerId,
    },
    /// The master's user pauses a worker: it stays connected, finishes its leases and gets no more. Idle workers may
    /// render the rows of those leases as well.
    PauseRequested {
        /// The worker to pause.
        worker: WorkerId,
    },
    /// The master's user resumes a paused worker. Draining workers go on draining.
    ResumeRequested {
        /// The worker to resume.
        worker: WorkerId,
    },
    /// The pixels of a lease are valid and in the framebuffer.
    SegmentDone {
        /// The worker that rendered them.
        worker: WorkerId,
        /// The lease as it was granted.
        lease: Lease,
        /// The cost that the worker reports.
        cost: Cost,
    },
    /// The second rendering of a segment was compared with the digest of the first one.
    SegmentVerified {
        /// The worker that rendered it the second time.
        worker: WorkerId,
        /// The lease as it was granted.
        lease: Lease,
        /// The cost that the worker reports.
        cost: Cost,
        /// Outcome of the comparison.
        finding: Finding,
    },
    /// The arbiter has rendered a segment on the master.
    SegmentArbitrated {
        /// The frame.
        frame: FrameId,
        /// The number of the verification in that frame.
        segment: u32,
        /// Renderings that differ from the master's.
        result: ArbiterResult,
    },
    /// Rows of a frame in flight have left its picture, because the worker that rendered them was banned.
    RowsRejected {
        /// The frame.
        frame: FrameId,
        /// The first of the rows.
        first_row: u32,
        /// Number of rows.
        row_count: u32,
    },
    /// A worker cannot render a frame.
    WorkerFailed {
        /// The worker.
        worker: WorkerId,
        /// The frame.
        frame: FrameId,
    },
    /// A worker has answered a ping.
    Pong {
        /// The worker.
        worker: WorkerId,
        /// The ping's nonce.
        nonce: u64,
        /// Whether its threads have made progress since its previous pong.
        progressed: bool,
    },
    /// A worker is alive: it is receiving assets.
    Heard {
        /// The worker.
        worker: WorkerId,
    },
    /// A part of a message of a worker has arrived: it is neither silent nor stalled. A long message over a slow link
    /// delays the pongs behind it. Reported for [`Scheduler::silent`](super::Scheduler::silent) workers.
    Receiving {
        /// The worker.
        worker: WorkerId,
    },
    /// The time of [`poll_timeout`](super::Scheduler::poll_timeout) has come.
    Woken,
}
