//! What the scheduler wants done.

use std::time::Duration;

use super::{Cost, FrameId, Lease, WorkerId};

/// What the shell is to do, in the order given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// A requested frame begins: make room for its pixels. Comes before its first lease.
    BeginFrame {
        /// Which.
        frame: FrameId,
    },
    /// A frame is complete: show it. Frames complete in the order of their numbers.
    FrameDone {
        /// Which.
        frame: FrameId,
        /// What its segments took, summed; every row counts once.
        cost: Cost,
        /// From its first lease to its last row.
        elapsed: Duration,
    },
    /// A frame, begun or not, has been superseded: forget it.
    FrameDropped {
        /// Which.
        frame: FrameId,
    },
    /// A frame is given up: every worker has refused it again and again.
    FrameFailed {
        /// Which.
        frame: FrameId,
    },
    /// Tell a worker what a frame shows. Comes before the worker's first lease of it.
    Announce {
        /// Whom.
        worker: WorkerId,
        /// Which frame.
        frame: FrameId,
    },
    /// Give a worker a segment to render.
    Grant {
        /// Whom.
        worker: WorkerId,
        /// Which rows.
        lease: Lease,
    },
    /// Remember what these rows of a picture look like, if all of them are this worker's: they are to be verified. Their
    /// number is no other segment's.
    Seal {
        /// Who rendered them.
        worker: WorkerId,
        /// The rows, and the number under which they are verified.
        lease: Lease,
    },
    /// Give a worker sealed rows to render again. They go into no picture: what they are worth is told by
    /// [`Event::SegmentVerified`](super::Event::SegmentVerified).
    Verify {
        /// Whom.
        worker: WorkerId,
        /// Which rows.
        lease: Lease,
    },
    /// Trace sealed rows here, compare them with whatever was sent, and tell of it by
    /// [`Event::SegmentJudged`](super::Event::SegmentJudged).
    Judge {
        /// The frame.
        frame: FrameId,
        /// The number under which the rows are verified.
        segment: u32,
    },
    /// Forget what sealed rows look like. Every seal ends so.
    Unseal {
        /// The frame.
        frame: FrameId,
        /// The number under which the rows were verified.
        segment: u32,
    },
    /// End a worker's session, if it has not ended yet, and keep it out; the scheduler has forgotten it already. Its rows
    /// leave all pictures in flight, which [`Event::RowsRejected`](super::Event::RowsRejected) tells of.
    Expel {
        /// Whom.
        worker: WorkerId,
        /// Why, for the log and for the worker.
        reason: String,
    },
    /// Tell a worker that leases of frames before this one are of no use any more.
    Cancel {
        /// Whom.
        worker: WorkerId,
        /// The first frame that is still wanted.
        before: FrameId,
    },
    /// Ask a worker for a sign of life.
    Ping {
        /// Whom.
        worker: WorkerId,
        /// Comes back in the answer.
        nonce: u64,
    },
    /// End a worker's session; the scheduler has forgotten it already.
    Dismiss {
        /// Whom.
        worker: WorkerId,
        /// Why, for the log and for the worker.
        reason: String,
        /// Whether it may connect again.
        again: Return,
    },
    /// Tell a worker that it gets no more leases; it finishes those it holds.
    Drain {
        /// Whom.
        worker: WorkerId,
    },
}

/// Whether a worker that is sent away may come back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Return {
    /// It is this session that has failed: a worker that was suspended is welcome when it wakes.
    Welcome,
    /// It was meant to leave: it need not try again.
    Unwanted,
    /// The farm itself ends: it may wait for the next one.
    NextMaster,
}
