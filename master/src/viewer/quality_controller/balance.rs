//! Bottleneck of frames: the render threads, or the wire that carries the pixels. Pure; reads the accounts of frames.
//!
//! Threads and wire work in parallel, so a frame takes the longer of both times. The time of the wire is known only where
//! threads wait for it: it is then their working time plus their waiting time. Where they do not wait, the wire takes at most
//! the time of the threads.

use rayfarm_farm::accounting::FrameAccount;

/// Bottleneck of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Limit {
    /// The render threads.
    Threads,
    /// The connection that carries pixels to the master.
    Wire,
}

/// Waiting time, as a part of the working time, above which the wire counts as the limit: short waits occur with any wire.
const WAITING: f64 = 0.25;
/// Ratio before the first frame: the wire takes half the time of the threads.
const AT_FIRST: f64 = 0.5;
/// Weight of the newest frame in the logarithm of the ratio.
const GAIN: f64 = 0.25;
/// Factor of change per frame below which the estimate counts as settled.
const SETTLED: f64 = 1.1;
/// Factor between the estimate and the one in use from which the ladder is replaced.
const NOTABLY: f64 = 1.3;
/// Largest ratio.
const MAX_RATIO: f64 = 1e3;

/// Time of the wire for the full picture, as a part of the threads' time for it.
#[derive(Clone, Debug)]
pub(super) struct Balance {
    ratio: f64,
    /// Estimate for which the ladder was made.
    used: f64,
    settled: bool,
    /// Recent waiting time of threads for the wire, as a part of their working time.
    waiting: f64,
}

impl Balance {
    /// The estimate before the first frame.
    pub(super) fn new() -> Self {
        Self { ratio: AT_FIRST, used: AT_FIRST, settled: true, waiting: 0.0 }
    }

    /// Adds a frame with `cost` times the work of the full picture, and `wire` times its bytes.
    pub(super) fn observe(&mut self, cost: f64, wire: f64, account: &FrameAccount) {
        let sum = |part: fn(&rayfarm_farm::accounting::Parts) -> u64| {
            account.workers.iter().map(|worker| part(&worker.parts) as f64).sum::<f64>()
        };
        let (busy, waited) = (sum(|parts| parts.trace.saturating_add(parts.encode)), sum(|parts| parts.send));
        let here = cost / wire;
        if busy <= 0.0 || !here.is_finite() || here <= 0.0 {
            return;
        }
        self.waiting += GAIN * ((waited / busy).min(MAX_RATIO) - self.waiting);
        let seen = if waited > WAITING * busy {
            (1.0 + waited / busy) * here
        } else {
            // This is an upper bound of the ratio.
            self.ratio.min((1.0 + WAITING) * here)
        };
        let step = GAIN * (seen.clamp(1.0 / MAX_RATIO, MAX_RATIO) / self.ratio).ln();
        self.ratio *= step.exp();
        self.settled = step.abs() < SETTLED.ln();
    }

    /// The estimate, if it differs notably from the last returned one.
    pub(super) fn take_change(&mut self) -> Option<f64> {
        // Below one the wire never limits the full picture: smaller ratios make no difference.
        let relevant = |ratio: f64| ratio.max(AT_FIRST);
        let apart = (relevant(self.ratio) / relevant(self.used)).ln().abs();
        (self.settled && apart > NOTABLY.ln()).then(|| {
            self.used = self.ratio;
            self.ratio
        })
    }

    /// Bottleneck of the recent frames.
    pub(super) fn limit(&self) -> Limit {
        if self.waiting > WAITING { Limit::Wire } else { Limit::Threads }
    }
}

impl Limit {
    /// Name of the bottleneck, for display.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Threads => "render threads",
            Self::Wire => "the wire",
        }
    }

    /// Advice on the bottleneck, for display.
    pub(super) fn remedy(self) -> &'static str {
        match self {
            Self::Threads => "more workers or a smaller window would help",
            Self::Wire => "a faster network or a smaller window would help; more workers would not",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayfarm_farm::accounting::{Parts, WorkerAccount};

    fn account(trace: u64, send: u64) -> FrameAccount {
        let parts = Parts { trace, send, ..Parts::default() };
        let worker = WorkerAccount { parts, ..WorkerAccount::default() };
        FrameAccount { workers: vec![worker.clone(), worker], segments: Vec::new() }
    }

    #[test]
    fn waiting_threads_measure_the_wire() {
        let mut balance = Balance::new();
        (0..20).for_each(|_| balance.observe(1.0, 1.0, &account(100, 300)));
        let ratio = balance.take_change().unwrap();
        assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
        assert_eq!(balance.limit(), Limit::Wire);
        assert_eq!(balance.take_change(), None, "each change is returned once");
    }

    #[test]
    fn a_frame_with_fewer_bytes_gives_the_same_ratio_of_the_full_one() {
        let mut balance = Balance::new();
        // A fifth of the work, a quarter of the bytes, and still twice the time on the wire.
        (0..30).for_each(|_| balance.observe(0.2, 0.25, &account(100, 100)));
        assert!((balance.ratio - 1.6).abs() < 0.05, "{}", balance.ratio);
    }

    #[test]
    fn busy_threads_bound_the_wire_from_above() {
        let mut balance = Balance::new();
        (0..30).for_each(|_| balance.observe(1.0, 1.0, &account(100, 300)));
        let known = balance.ratio;
        // With a quarter of the bytes the threads are the limit, as expected: the full picture's wire has not changed.
        (0..30).for_each(|_| balance.observe(1.0, 0.25, &account(100, 5)));
        assert!(balance.ratio > 0.95 * known, "{} for {known}", balance.ratio);
        assert_eq!(balance.limit(), Limit::Threads);
        // With all bytes they would not be if the wire were still slow.
        (0..30).for_each(|_| balance.observe(1.0, 1.0, &account(100, 5)));
        assert!(balance.ratio < 1.3, "{}", balance.ratio);
    }

    #[test]
    fn short_waits_and_empty_accounts_change_nothing() {
        let mut balance = Balance::new();
        balance.observe(1.0, 1.0, &FrameAccount::default());
        (0..50).for_each(|_| balance.observe(1.0, 1.0, &account(100, 15)));
        assert_eq!((balance.take_change(), balance.limit()), (None, Limit::Threads));
    }
}
