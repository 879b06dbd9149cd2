//! Output of the scheduler: actions.

use std::time::Duration;

use super::{Cost, FrameId, Lease, Reconnect, WorkerId};

/// Action of the scheduler. The shell performs actions in the order in which they are polled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Begin a requested frame: allocate its framebuffer. Comes before the frame's first lease.
    BeginFrame {
        /// The frame.
        frame: FrameId,
    },
    /// Deliver a complete frame. Frames complete in the order of their numbers.
    FrameDone {
        /// The frame.
        frame: FrameId,
        /// Sum of its segments' costs; every row counts once.
        cost: Cost,
        /// Time from its first lease to its last row.
        elapsed: Duration,
    },
    /// Discard a frame, begun or not: a newer request supersedes it.
    FrameDropped {
        /// The frame.
        frame: FrameId,
    },
    /// Discard a frame and report an error: every worker has refused it repeatedly.
    FrameFailed {
        /// The frame.
        frame: FrameId,
    },
    /// Send a worker the view of a frame. Comes before the worker's first lease of that frame.
    Announce {
        /// The worker.
        worker: WorkerId,
        /// The frame.
        frame: FrameId,
    },
    /// Send a worker a segment to render.
    Grant {
        /// The worker.
        worker: WorkerId,
        /// The rows.
        lease: Lease,
    },
    /// Record the digest of rows of a picture, if all of them are this worker's: they are going to be verified.
    RecordDigest {
        /// The worker that rendered them first.
        worker: WorkerId,
        /// The rows. The segment number is that of the verification and of no other segment.
        lease: Lease,
    },
    /// Send a worker rows with a recorded digest to render a second time. The pixels go into no picture;
    /// [`Event::SegmentVerified`](super::Event::SegmentVerified) reports the comparison.
    Verify {
        /// The worker.
        worker: WorkerId,
        /// The rows.
        lease: Lease,
    },
    /// Render rows with a recorded digest on the master and compare both renderings with it;
    /// [`Event::SegmentArbitrated`](super::Event::SegmentArbitrated) reports the result.
    Arbitrate {
        /// The frame.
        frame: FrameId,
        /// The number of the verification in that frame.
        segment: u32,
    },
    /// Drop a recorded digest. Every digest ends so.
    DropDigest {
        /// The frame.
        frame: FrameId,
        /// The number of the verification in that frame.
        segment: u32,
    },
    /// Ban a worker and end its session, if it is still connected; the scheduler has removed it already. Its rows
    /// leave all pictures in flight, which [`Event::RowsRejected`](super::Event::RowsRejected) reports.
    Ban {
        /// The worker.
        worker: WorkerId,
        /// For the log and for the worker.
        reason: String,
    },
    /// Cancel a worker's leases of all frames before `before`.
    Cancel {
        /// The worker.
        worker: WorkerId,
        /// The first frame that is still requested.
        before: FrameId,
    },
    /// Send a keepalive ping.
    Ping {
        /// The worker.
        worker: WorkerId,
        /// Returned by the pong.
        nonce: u64,
    },
    /// End a worker's session; the scheduler has removed the worker already.
    Disconnect {
        /// The worker.
        worker: WorkerId,
        /// For the log and for the worker.
        reason: String,
        /// Whether the worker may connect again, and to which master.
        reconnect: Reconnect,
    },
    /// Notify a worker that it drains: it finishes its leases and gets no more.
    Drain {
        /// The worker.
        worker: WorkerId,
    },
}
