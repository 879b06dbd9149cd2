//! Virtual time and the queue of future events.

use std::collections::BTreeMap;
use std::time::Duration;

use rayfarm_scheduler::{ArbiterResult, Cost, FrameId, Lease, WorkerId};

/// Nanoseconds per second.
pub(crate) const SECOND: u64 = 1_000_000_000;

/// An event of the simulation.
#[derive(Clone, Debug)]
pub(crate) enum SimEvent {
    /// A message reaches its worker.
    AtWorker(WorkerId, MasterMessage),
    /// A message reaches the master's link.
    AtLink(WorkerId, WorkerMessage),
    /// The master reads a message.
    AtMaster(WorkerId, WorkerMessage),
    /// A thread of a worker finishes a band.
    BandDone { worker: WorkerId, thread: usize },
    /// The master learns that a connection is closed.
    Closed(WorkerId),
    /// A stopped or slow worker recovers.
    Recovered(WorkerId),
    /// The camera moves.
    Input,
    /// A frame is complete and the next one is requested.
    Request,
    /// A fault is injected.
    Fault,
    /// The arbiter has rendered rows on the master.
    Arbitrated { frame: FrameId, segment: u32, result: ArbiterResult },
}

/// A message from the master to a worker.
#[derive(Clone, Copy, Debug)]
pub(crate) enum MasterMessage {
    Announce,
    Lease(Lease),
    Cancel(FrameId),
    Ping(u64),
    Drain,
}

/// A message from a worker to the master.
#[derive(Clone, Copy, Debug)]
pub(crate) enum WorkerMessage {
    /// `content` is the error value of each of its rows: 0 where the pixels are right.
    Pixels {
        lease: Lease,
        cost: Cost,
        fits: bool,
        content: u64,
    },
    Pong {
        nonce: u64,
        progressed: bool,
    },
    Failed(FrameId),
    Drain,
}

/// Virtual time in nanoseconds, and future events in order. Events of the same time keep the order in which they
/// were scheduled.
#[derive(Debug, Default)]
pub(crate) struct Clock {
    pub(crate) now: u64,
    queue: BTreeMap<(u64, u64), SimEvent>,
    scheduled: u64,
}

impl Clock {
    pub(crate) fn schedule(&mut self, at: u64, event: SimEvent) {
        self.scheduled += 1;
        self.queue.insert((at.max(self.now), self.scheduled), event);
    }

    pub(crate) fn next_at(&self) -> Option<u64> {
        self.queue.first_key_value().map(|((at, _), _)| *at)
    }

    pub(crate) fn pop(&mut self) -> Option<SimEvent> {
        self.queue.pop_first().map(|(_, event)| event)
    }

    /// Cancels future events.
    pub(crate) fn cancel(&mut self, which: impl Fn(&SimEvent) -> bool) {
        self.queue.retain(|_, event| !which(event));
    }

    pub(crate) fn time(&self) -> Duration {
        Duration::from_nanos(self.now)
    }
}
