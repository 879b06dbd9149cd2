//! The account of one worker.

use std::collections::BTreeMap;
use std::time::Duration;

use rayfarm_protocol::{FrameId, Lease};

use super::parts::{Claim, Parts};

/// What a worker has done with its time since the last frame.
#[derive(Debug)]
pub(super) struct Ledger {
    pub(super) threads: u64,
    /// Up to here, time is put down.
    mark: Duration,
    /// The leases that it holds, and since when.
    held: BTreeMap<Lease, Duration>,
    /// Time under leases since the last answer.
    open: Duration,
    /// It has asked for an asset and answered no lease since.
    fetching: bool,
    /// It gets no leases because the master's user says so: such time is nobody's loss.
    paused: bool,
    /// Thread time under leases that have been answered, and what the answers say about it.
    answered: u64,
    claim: Claim,
    /// Everything else.
    settled: Parts,
}

/// What an answer says.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Answer {
    /// Nanoseconds, summed over threads.
    pub(super) trace_ns: u64,
    /// Nanoseconds, summed over threads.
    pub(super) encode_ns: u64,
    /// Nanoseconds between the arrival of the lease and the beginning of its first row.
    pub(super) wait_ns: u64,
    /// Nanoseconds from there to the moment the pixels were ready to be sent.
    pub(super) span_ns: u64,
    /// What the master needed to take the pixels in.
    pub(super) decode: Duration,
}

/// A stretch of time whose account is known.
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

    /// Time up to now is put down to what the worker has been doing; what that was, if it held no leases.
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

    /// Nothing before now counts: nobody has asked for anything yet.
    pub(super) fn begin(&mut self, now: Duration) {
        self.mark = now;
    }

    /// It gets a lease. Time is up to date.
    pub(super) fn grant(&mut self, lease: Lease) {
        self.held.insert(lease, self.mark);
    }

    /// It asks for an asset. Time is up to date.
    pub(super) fn fetch(&mut self) {
        self.fetching = true;
    }

    /// It gets no more leases, or does again. Time is up to date.
    pub(super) fn pause(&mut self, paused: bool) {
        self.paused = paused;
    }

    /// It answers a lease that it holds; what came of the time since the answer before. Time is up to date.
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

    /// Leases are taken back: the time that went into them has been spent in vain. Time is up to date.
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

    /// The worker has failed to render a frame, and is asked for nothing for a while.
    pub(super) fn fail(&mut self) -> Option<Stretch> {
        self.fetching = false;
        self.revoke(|_| true)
    }

    /// Whether it holds leases of a frame before `before`.
    pub(super) fn holds_before(&self, before: FrameId) -> bool {
        self.held.keys().any(|lease| lease.frame < before)
    }

    /// Closes the account of a frame. Time is up to date.
    pub(super) fn close(&mut self) -> Parts {
        let mut parts = std::mem::take(&mut self.settled);
        let (answered, claim) = (std::mem::take(&mut self.answered), std::mem::take(&mut self.claim));
        let given = claim.split(answered);
        parts.add(&given);
        // Threads work ahead of the answers: an answer may tell of work done in the time of the frame before. Such a
        // surplus waits for the time of the next frame, but no more of it than one frame can have.
        self.claim.trace = (claim.trace - given.trace).min(answered);
        self.claim.encode = (claim.encode - given.encode).min(answered);
        if self.fetching {
            parts.scene = parts.scene.saturating_add(self.thread_time(self.open));
            self.open = Duration::ZERO;
        }
        parts
    }

    /// Thread time under leases that nobody has answered yet.
    #[cfg(test)]
    pub(super) fn unsettled(&self) -> u64 {
        self.thread_time(self.open)
    }

    /// What an answer claims of the time that its lease was held. The worker says how long the lease lay with it and how
    /// long it was at it, the master knows how long it took the pixels in; the rest of the time, something was on the wire.
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
