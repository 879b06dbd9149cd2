//! What a frame waits for: the render threads, or the wire that its pixels come over. Pure; fed with the accounts of frames.
//!
//! The two work side by side, so a frame takes the longer of both. How much longer the wire takes than the threads is
//! known only where threads wait for it: then their idle time is what the wire takes beyond their own. Where they do not,
//! the wire takes no longer than they do, and nothing more is known.

use crate::accounting::FrameAccount;

/// What keeps frames from being faster.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Limit {
    /// The render threads.
    Threads,
    /// The way of the pixels to the master.
    Wire,
}

/// The wire counts as the limit where threads wait for it by this part of the time that they work: short waits are
/// there with any wire.
const WAITING: f64 = 0.25;
/// What is believed of the wire before anything is known: it takes half as long as the threads.
const AT_FIRST: f64 = 0.5;
/// How much of the logarithm the newest frame decides.
const GAIN: f64 = 0.25;
/// Frames whose estimate changes by less than this factor make it settled.
const SETTLED: f64 = 1.1;
/// Another ladder is worth it when the estimate has moved away from the one in use by this factor.
const NOTABLY: f64 = 1.3;
/// No wire is taken to be slower than this.
const MOST: f64 = 1e3;

/// How long the wire takes for the full picture, as a part of what the threads take for it.
#[derive(Clone, Debug)]
pub(super) struct Balance {
    ratio: f64,
    /// The estimate that the ladder was made for.
    used: f64,
    settled: bool,
    /// How long threads have lately waited for the wire, as a part of the time that they worked.
    waiting: f64,
}

impl Balance {
    /// Before the first frame.
    pub(super) fn new() -> Self {
        Self { ratio: AT_FIRST, used: AT_FIRST, settled: true, waiting: 0.0 }
    }

    /// A frame came whose work was `cost` of the full one's, and whose bytes `wire` of the full one's.
    pub(super) fn observe(&mut self, cost: f64, wire: f64, account: &FrameAccount) {
        let sum = |part: fn(&crate::accounting::Parts) -> u64| {
            account.workers.iter().map(|worker| part(&worker.parts) as f64).sum::<f64>()
        };
        let (busy, waited) = (sum(|parts| parts.trace.saturating_add(parts.encode)), sum(|parts| parts.send));
        let here = cost / wire;
        if busy <= 0.0 || !here.is_finite() || here <= 0.0 {
            return;
        }
        self.waiting += GAIN * ((waited / busy).min(MOST) - self.waiting);
        let seen = if waited > WAITING * busy {
            (1.0 + waited / busy) * here
        } else {
            // It takes no longer than that; it may take any less.
            self.ratio.min((1.0 + WAITING) * here)
        };
        let step = GAIN * (seen.clamp(1.0 / MOST, MOST) / self.ratio).ln();
        self.ratio *= step.exp();
        self.settled = step.abs() < SETTLED.ln();
    }

    /// The estimate, where it has become notably another than the one that was returned last.
    pub(super) fn news(&mut self) -> Option<f64> {
        // Below one the wire is no limit of any full picture: nothing changes before it comes near.
        let relevant = |ratio: f64| ratio.max(AT_FIRST);
        let apart = (relevant(self.ratio) / relevant(self.used)).ln().abs();
        (self.settled && apart > NOTABLY.ln()).then(|| {
            self.used = self.ratio;
            self.ratio
        })
    }

    /// What limits the frames of late.
    pub(super) fn limit(&self) -> Limit {
        if self.waiting > WAITING { Limit::Wire } else { Limit::Threads }
    }
}

impl Limit {
    /// What limits, in a few words.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Threads => "render threads",
            Self::Wire => "the wire",
        }
    }

    /// What would help.
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
    use crate::accounting::{Parts, WorkerAccount};

    fn account(trace: u64, send: u64) -> FrameAccount {
        let parts = Parts { trace, send, ..Parts::default() };
        let worker = WorkerAccount { parts, ..WorkerAccount::default() };
        FrameAccount { workers: vec![worker.clone(), worker], segments: Vec::new() }
    }

    #[test]
    fn threads_that_wait_for_the_wire_tell_how_slow_it_is() {
        let mut balance = Balance::new();
        (0..20).for_each(|_| balance.observe(1.0, 1.0, &account(100, 300)));
        let ratio = balance.news().unwrap();
        assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
        assert_eq!(balance.limit(), Limit::Wire);
        assert_eq!(balance.news(), None, "it is no news twice");
    }

    #[test]
    fn a_frame_with_fewer_bytes_tells_the_same_of_the_full_one() {
        let mut balance = Balance::new();
        // A fifth of the work, a quarter of the bytes, and still twice the time on the wire.
        (0..30).for_each(|_| balance.observe(0.2, 0.25, &account(100, 100)));
        assert!((balance.ratio - 1.6).abs() < 0.05, "{}", balance.ratio);
    }

    #[test]
    fn busy_threads_say_only_that_the_wire_is_no_slower() {
        let mut balance = Balance::new();
        (0..30).for_each(|_| balance.observe(1.0, 1.0, &account(100, 300)));
        let known = balance.ratio;
        // With a quarter of the bytes the threads are the limit, as was to be expected: the full picture's wire is as it was.
        (0..30).for_each(|_| balance.observe(1.0, 0.25, &account(100, 5)));
        assert!(balance.ratio > 0.95 * known, "{} for {known}", balance.ratio);
        assert_eq!(balance.limit(), Limit::Threads);
        // With all bytes they would not be, if it were still so slow.
        (0..30).for_each(|_| balance.observe(1.0, 1.0, &account(100, 5)));
        assert!(balance.ratio < 1.3, "{}", balance.ratio);
    }

    #[test]
    fn short_waits_and_empty_accounts_are_no_news() {
        let mut balance = Balance::new();
        balance.observe(1.0, 1.0, &FrameAccount::default());
        (0..50).for_each(|_| balance.observe(1.0, 1.0, &account(100, 15)));
        assert_eq!((balance.news(), balance.limit()), (None, Limit::Threads));
    }
}
