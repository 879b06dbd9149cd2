//! Marks and spans of a timeline.

use std::time::Duration;

use rayfarm_protocol::{FrameId, Lease};
use rayfarm_scheduler::WorkerId;

use super::parts::Parts;

/// An entry of a timeline. Spans of one track are disjoint or nested; an outer span comes before its inner ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Mark {
    /// The name of a worker's track.
    Named { worker: WorkerId, name: String, threads: u32 },
    /// A span of time.
    Span(Span),
}

/// A span of time on one track.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    /// The worker whose track it is on; `None` for the master's.
    pub(crate) worker: Option<WorkerId>,
    pub(crate) from: Duration,
    pub(crate) to: Duration,
    pub(crate) what: What,
}

/// Kind of activity that a span shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum What {
    /// A frame: from the end of the previous frame or its own start, whichever is later, to its end.
    Frame { frame: FrameId, elapsed: Duration },
    /// A lease: from its grant or the previous reply, whichever is later, to its reply.
    Segment { lease: Lease, bytes: u64 },
    /// A part of the account.
    Part(&'static str),
}

/// Spans for the parts of one stretch of `threads` threads, one after the other and ending at `to`. They show how long each
/// part took, not when it happened.
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
