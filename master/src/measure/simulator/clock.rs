//! What is going to happen, in order.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::scheduler::{ArbiterResult, Cost, FrameId, Lease, WorkerId};

/// Something that happens at its time.
#[derive(Clone, Debug)]
pub(crate) enum Happening {
    /// A message has reached its worker.
    AtWorker(WorkerId, Down),
    /// A message has reached the master's link.
    AtLink(WorkerId, Up),
    /// A message has been read by the master.
    AtMaster(WorkerId, Up),
    /// A thread of a worker has finished a band.
    BandDone { worker: WorkerId, thread: usize },
    /// The master learns that a connection is gone.
    Closed(WorkerId),
    /// A worker that stood still goes on, or one that was slow is not any more.
    Recovered(WorkerId),
    /// The camera moves.
    Input,
    /// A frame is complete, and the next one is wanted.
    Request,
    /// Something goes wrong.
    Fault,
    /// The master has traced rows itself.
    Judged { frame: FrameId, segment: u32, verdict: ArbiterResult },
}

/// What a master says.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Down {
    Announce,
    Lease(Lease),
    Cancel(FrameId),
    Ping(u64),
    Drain,
}

/// What a worker says.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Up {
    /// `content` is 0 in each row where the pixels are the right ones.
    Pixels {
        lease: Lease,
        cost: Cost,
        fits: bool,
        content: u64,
    },
    Pong(u64),
    Failed(FrameId),
    Drain,
}

/// Virtual time and its agenda. What happens at one time happens in the order in which it was planned.
#[derive(Debug, Default)]
pub(crate) struct Clock {
    pub(crate) now: u64,
    agenda: BTreeMap<(u64, u64), Happening>,
    planned: u64,
}

impl Clock {
    pub(crate) fn plan(&mut self, at: u64, happening: Happening) {
        self.planned += 1;
        self.agenda.insert((at.max(self.now), self.planned), happening);
    }

    pub(crate) fn next_at(&self) -> Option<u64> {
        self.agenda.first_key_value().map(|((at, _), _)| *at)
    }

    pub(crate) fn pop(&mut self) -> Option<Happening> {
        self.agenda.pop_first().map(|(_, happening)| happening)
    }

    /// Nothing of this kind will happen.
    pub(crate) fn forget(&mut self, which: impl Fn(&Happening) -> bool) {
        self.agenda.retain(|_, happening| !which(happening));
    }

    pub(crate) fn time(&self) -> Duration {
        Duration::from_nanos(self.now)
    }
}
