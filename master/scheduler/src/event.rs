//! What happens to the scheduler.

use std::fmt;

use super::{Cost, Finding, FrameId, Lease, Verdict};

/// A connected worker. Numbers are given by the shell and never reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorkerId(pub u64);

impl fmt::Display for WorkerId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "worker {}", self.0)
    }
}

/// The machine on which a worker runs, as far as the shell can tell. Workers of one machine do not vouch for each other
/// where a worker of another one can.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct HostId(pub u128);

/// What the shell reports. Events of unknown workers and of frames that are over are ignored, so the shell need
/// not know what has become of either.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A frame is wanted. Its number is greater than that of every frame before it.
    FrameRequested {
        /// Its number.
        frame: FrameId,
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// Rows that workers trace together, from multiples of it on: cuts elsewhere cost them.
        tile_rows: u32,
    },
    /// Nothing that was requested before a frame is wanted any more.
    RequestsGivenUp {
        /// That frame's number; it need not be requested yet.
        next: FrameId,
    },
    /// A session is ready for leases.
    WorkerJoined {
        /// The new worker.
        worker: WorkerId,
        /// Its render threads: a first guess at its speed.
        threads: u32,
        /// Where it runs.
        host: HostId,
    },
    /// A session is over, for whatever reason.
    WorkerLeft {
        /// The lost worker.
        worker: WorkerId,
    },
    /// A worker asks for no more leases; it finishes those it has.
    WorkerDrains {
        /// The leaving worker.
        worker: WorkerId,
    },
    /// The master's user wants a worker to leave once it has finished what it holds. It is told; it is dismissed when
    /// it holds nothing any more.
    DrainRequested {
        /// Which worker.
        worker: WorkerId,
    },
    /// The master's user wants a worker to get no more leases until further notice. It stays connected and finishes
    /// what it holds; whoever is idle may render that as well.
    PauseRequested {
        /// Which worker.
        worker: WorkerId,
    },
    /// A paused worker gets leases again. A draining one does not.
    ResumeRequested {
        /// Which worker.
        worker: WorkerId,
    },
    /// The pixels of a lease were checked and are in the framebuffer.
    SegmentDone {
        /// Who rendered them.
        worker: WorkerId,
        /// The lease as it was granted.
        lease: Lease,
        /// What the worker says they took.
        cost: Cost,
    },
    /// A segment of an audit was rendered again, and compared with what its seal tells.
    SegmentVerified {
        /// Who rendered it.
        worker: WorkerId,
        /// The lease as it was granted.
        lease: Lease,
        /// What the worker says it took.
        cost: Cost,
        /// What has come of it.
        finding: Finding,
    },
    /// The master has traced a segment of an audit itself.
    SegmentJudged {
        /// The frame.
        frame: FrameId,
        /// The number of the audit in it.
        segment: u32,
        /// Whose bytes are others.
        verdict: Verdict,
    },
    /// Rows of a frame in flight are not in its picture any more: whoever sent them was expelled.
    RowsRejected {
        /// Which frame.
        frame: FrameId,
        /// The first of them.
        first_row: u32,
        /// How many.
        row_count: u32,
    },
    /// A worker cannot render a frame.
    WorkerFailed {
        /// Who cannot.
        worker: WorkerId,
        /// Which frame.
        frame: FrameId,
    },
    /// A ping was answered.
    Pong {
        /// By whom.
        worker: WorkerId,
        /// The ping's number.
        nonce: u64,
    },
    /// A worker has given another sign of life: it takes the assets that it is sent.
    Heard {
        /// Who.
        worker: WorkerId,
    },
    /// The time of [`poll_timeout`](super::Scheduler::poll_timeout) has come.
    Woken,
}
