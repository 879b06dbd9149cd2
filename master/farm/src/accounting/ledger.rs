//! The account of one worker.

use std::collections::BTreeMap;
use std::time::Duration;

use rayfarm_protocol::{FrameId, Lease};

use super::parts::{Claim, Parts};

/// The account of one worker since the last frame.
#[derive(Debug)]
pub(super) struct Ledger {
    pub(super) threads: u64,
    /// Time up to here is attributed.
    mark: Duration,
    /// The leases that it holds, with the times of their grants.
    held: BTreeMap<Lease, Duration>,
    /// Time under leases since the last reply.
    open: Duration,
    /// Whether it has requested an asset and replied to no lease since.
    fetching: bool,
    /// Whether it is paused by a user: such time is not accounted.
    paused: bool,
    /// Thread time under leases that are answered, and the claims of these replies.
    answered: u64,
    claim: Claim,
    /// All other time, by part.
    settled: Parts,
}

/// Times of one reply.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Answer {
    /// Nanoseconds, summed over threads.
    pub(super) trace_ns: u64,
    /// Nanoseconds, summed over threads.
    pub(super) encode_ns: u64,
    /// Nanoseconds from the arrival of the lease to the start of its first row.
    pub(super) wait_ns: u64,
    /// Nanoseconds from there until the pixels were ready to send.
    pub(super) span_ns: u64,
    /// Time in which the master decoded the pixels.
    pub(super) decode: Duration,
}

/// A stretch of time with its parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    pub(super) from: Duration,
    pub(super) parts: Parts,
}

impl Ledger {
    pub(super) fn new(now: Duration, threads: u32) -> Self {
        Self {
            threads: u64::from(threads.max(1)),
            mark: now,
            held: BTreeMap::new(),
            open: Duration::ZERO,
            fetching: false,
            paused: false,
            answered: 0,
            claim: Claim::default(),
            settled: Parts::default(),
        }
    }

    /// Attributes the time up to now. Returns the stretch, if the worker held no leases in it.
    pub(super) fn advance(&mut self, now: Duration, frames_in_flight: bool) -> Option<Stretch> {
        let from = self.mark;
        let passed = now.saturating_sub(from);
        self.mark = from.max(now);
        if passed.is_zero() {
            return None;
        }
        if !self.held.is_empty() {
            self.open += passed;
            return None;
        }
        if self.paused {
            return None;
        }
        let time = self.thread_time(passed);
        let parts = match (self.fetching, frames_in_flight) {
            (true, _) => Parts { scene: time, ..Parts::default() },
            (false, true) => Parts { idle_tail: time, ..Parts::default() },
            (false, false) => Parts { wait: time, ..Parts::default() },
        };
        self.settled.add(&parts);
        Some(Stretch { from, parts })
    }

    /// Drops the time before now: no frame was requested in it.
    pub(super) fn begin(&mut self, now: Duration) {
        self.mark = now;
    }

    /// Adds a lease. Time must be attributed up to now.
    pub(super) fn grant(&mut self, lease: Lease) {
        self.held.insert(lease, self.mark);
    }

    /// Notes a request for an asset. Time must be attributed up to now.
    pub(super) fn fetch(&mut self) {
        self.fetching = true;
    }

    /// Pauses or resumes the worker. Time must be attributed up to now.
    pub(super) fn pause(&mut self, paused: bool) {
        self.paused = paused;
    }

    /// Notes a reply to a lease. Returns the stretch since the previous reply. Time must be attributed up to now.
    pub(super) fn answer(&mut self, lease: &Lease, answer: Answer) -> Option<Stretch> {
        let granted = self.held.remove(lease)?;
        let open = std::mem::take(&mut self.open);
        let from = self.mark.saturating_sub(open);
        let budget = self.thread_time(open);
        let claim = self.claim(answer, self.mark.saturating_sub(granted));
        if std::mem::take(&mut self.fetching) {
            let Parts { trace, encode, decode, send, wait, .. } = claim.split(budget);
            let scene = decode.saturating_add(send).saturating_add(wait);
            let parts = Parts { trace, encode, scene, ..Parts::default() };
            self.settled.add(&parts);
            return Some(Stretch { from, parts });
        }
        self.answered = self.answered.saturating_add(budget);
        self.claim.add(claim);
        Some(Stretch { from, parts: claim.split(budget) })
    }

    /// Revokes leases: the time spent on them produced no pixel of a picture. Time must be attributed up to now.
    pub(super) fn revoke(&mut self, which: impl Fn(&Lease) -> bool) -> Option<Stretch> {
        self.held.retain(|lease, _| !which(lease));
        if self.open.is_zero() || !self.held.is_empty() {
            return None;
        }
        let open = std::mem::take(&mut self.open);
        let parts = Parts { idle_tail: self.thread_time(open), ..Parts::default() };
        self.settled.add(&parts);
        Some(Stretch { from: self.mark.saturating_sub(open), parts })
    }

    /// Revokes all leases of a worker that failed to render a frame or has disconnected.
    pub(super) fn fail(&mut self) -> Option<Stretch> {
        self.fetching = false;
        self.revoke(|_| true)
    }

    /// Whether it holds leases of a frame before `before`.
    pub(super) fn holds_before(&self, before: FrameId) -> bool {
        self.held.keys().any(|lease| lease.frame < before)
    }

    /// Closes the account of a frame. Time must be attributed up to now.
    pub(super) fn close(&mut self) -> Parts {
        let mut parts = std::mem::take(&mut self.settled);
        let (answered, claim) = (std::mem::take(&mut self.answered), std::mem::take(&mut self.claim));
        let given = claim.split(answered);
        parts.add(&given);
        // A reply may report work that was done in the time of the previous frame. Such a surplus is attributed to the time of
        // the next frame, up to one frame's time.
        self.claim.trace = (claim.trace - given.trace).min(answered);
        self.claim.encode = (claim.encode - given.encode).min(answered);
        if self.fetching {
            parts.scene = parts.scene.saturating_add(self.thread_time(self.open));
            self.open = Duration::ZERO;
        }
        parts
    }

    /// Thread time under leases that are not answered yet.
    #[cfg(test)]
    pub(super) fn unsettled(&self) -> u64 {
        self.thread_time(self.open)
    }

    /// The claim of a reply on the time for which its lease was held. The worker reports its waiting and rendering, the
    /// master measures the decoding; in the rest of the time, leases or pixels were on the wire.
    fn claim(&self, answer: Answer, held: Duration) -> Claim {
        let Answer { trace_ns, encode_ns, wait_ns, span_ns, decode } = answer;
        let known = Duration::from_nanos(wait_ns.saturating_add(span_ns)).saturating_add(decode);
        Claim {
            trace: trace_ns,
            encode: encode_ns,
            decode: self.thread_time(decode),
            send: self.thread_time(held.saturating_sub(known)),
        }
    }

    fn thread_time(&self, wall: Duration) -> u64 {
        u64::try_from(wall.as_nanos()).unwrap_or(u64::MAX).saturating_mul(self.threads)
    }
}
