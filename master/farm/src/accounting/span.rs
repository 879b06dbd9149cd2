//! Stretches of time as a timeline shows them.

use std::time::Duration;

use rayfarm_protocol::{FrameId, Lease};

use super::parts::Parts;
use rayfarm_scheduler::WorkerId;

/// What a timeline shows, in the order in which it is known. Spans of one track follow each other or lie inside
/// each other; an outer one comes before those inside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Mark {
    /// A worker has come: its track gets a name.
    Named { worker: WorkerId, name: String, threads: u32 },
    /// Something lasted.
    Span(Span),
}

/// A stretch of time on one track.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    /// The worker whose track it is on; `None` for the master's.
    pub(crate) worker: Option<WorkerId>,
    pub(crate) from: Duration,
    pub(crate) to: Duration,
    pub(crate) what: What,
}

/// What lasted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum What {
    /// A frame, from the end of the one before or its own beginning, whichever is later.
    Frame { frame: FrameId, elapsed: Duration },
    /// A lease, from its grant or the answer before, whichever is later, to its answer.
    Segment { lease: Lease, bytes: u64 },
    /// A part of the account.
    Part(&'static str),
}

/// The parts of one stretch of `threads` threads, laid out one after the other: a picture of how long each was, not
/// of when it happened. They end at `to`; what is missing is at the beginning.
pub(super) fn laid_out(worker: WorkerId, to: Duration, threads: u64, parts: &Parts) -> Vec<Span> {
    let Parts { trace, wait, encode, send, decode, idle_tail, scene } = *parts;
    let in_order = [
        ("wait", wait),
        ("scene", scene),
        ("trace", trace),
        ("encode", encode),
        ("send", send),
        ("decode", decode),
        ("idle_tail", idle_tail),
    ];
    let total = parts.total();
    let begin = to.saturating_sub(Duration::from_nanos(total / threads.max(1)));
    let mut done = 0_u64;
    let mut spans = Vec::new();
    for (name, nanoseconds) in in_order {
        let from = begin + Duration::from_nanos(done / threads.max(1));
        done = done.saturating_add(nanoseconds);
        let until = begin + Duration::from_nanos(done / threads.max(1));
        if until > from {
            spans.push(Span { worker: Some(worker), from, to: until.min(to), what: What::Part(name) });
        }
    }
    spans
}
