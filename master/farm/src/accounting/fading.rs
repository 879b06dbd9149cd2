//! Accounts smoothed over about one second, for overlays.

use std::collections::BTreeMap;
use std::time::Duration;

use super::accounts::{FrameAccount, WorkerAccount};
use super::parts::{PART_COUNT, Parts};

/// Time constant of the exponential decay: after this time, a frame's weight is 1/e.
const MEMORY: Duration = Duration::from_secs(1);

/// Exponentially decaying sums over the connected workers.
#[derive(Clone, Debug, Default)]
pub struct Fading {
    workers: BTreeMap<u64, Faded>,
    at: Duration,
}

/// The decaying sums of one worker.
#[derive(Clone, Debug, Default)]
struct Faded {
    parts: [f64; PART_COUNT],
    frames: f64,
    bytes: f64,
}

/// The smoothed account of one worker, or of all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Smoothed {
    /// Percent of thread time, in the order of [`super::PART_NAMES`].
    pub percent: [f64; PART_COUNT],
    /// Bytes of pixels per frame.
    pub bytes: f64,
}

impl Fading {
    /// Adds the account of a frame that was completed at `at`.
    pub fn add(&mut self, at: Duration, account: &FrameAccount) {
        let keep = (-at.saturating_sub(self.at).div_duration_f64(MEMORY)).exp();
        self.at = at;
        let connected = |id: &u64| account.workers.iter().any(|worker| worker.id == *id);
        self.workers.retain(|id, _| connected(id));
        for WorkerAccount { id, parts, bytes, .. } in &account.workers {
            let faded = self.workers.entry(*id).or_default();
            faded.add(keep, parts, *bytes);
        }
    }

    /// The account of a worker; `None` before its first frame.
    pub fn of(&self, id: u64) -> Option<Smoothed> {
        self.workers.get(&id).map(Faded::smoothed)
    }

    /// The account of all workers together; `None` before the first frame.
    pub fn sum(&self) -> Option<Smoothed> {
        let mut sum = Faded::default();
        for worker in self.workers.values() {
            sum.parts.iter_mut().zip(worker.parts).for_each(|(sum, part)| *sum += part);
            sum.frames = sum.frames.max(worker.frames);
            sum.bytes += worker.bytes;
        }
        (!self.workers.is_empty()).then(|| sum.smoothed())
    }
}

impl Faded {
    fn add(&mut self, keep: f64, parts: &Parts, bytes: u64) {
        for (sum, part) in self.parts.iter_mut().zip(parts.values()) {
            *sum = *sum * keep + part as f64;
        }
        self.frames = self.frames * keep + 1.0;
        self.bytes = self.bytes * keep + bytes as f64;
    }

    fn smoothed(&self) -> Smoothed {
        let total: f64 = self.parts.iter().sum();
        let share = |part: f64| if total > 0.0 { 100.0 * part / total } else { 0.0 };
        Smoothed { percent: self.parts.map(share), bytes: self.bytes / self.frames.max(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u64, trace: u64, wait: u64) -> FrameAccount {
        let parts = Parts { trace, wait, ..Parts::default() };
        let worker = WorkerAccount { id, parts, bytes: 100, ..WorkerAccount::default() };
        FrameAccount { workers: vec![worker], segments: Vec::new() }
    }

    #[test]
    fn old_frames_decay_and_percentages_sum_to_100() {
        let mut fading = Fading::default();
        let step = Duration::from_millis(100);
        for index in 0..10 {
            fading.add(step * index, &frame(1, 1000, 0));
        }
        for index in 10..80 {
            fading.add(step * index, &frame(1, 250, 750));
        }
        let Smoothed { percent, bytes } = fading.of(1).unwrap();
        assert!((percent.iter().sum::<f64>() - 100.0).abs() < 1e-9);
        assert!((percent[0] - 25.0).abs() < 1.0, "{percent:?}");
        assert!((bytes - 100.0).abs() < 1e-9);
    }

    #[test]
    fn time_without_requests_is_not_waiting() {
        let account = |threads| {
            let mut account = frame(1, 1000, 60_500);
            account.workers[0].threads = threads;
            account.without_rest(Duration::from_nanos(30_000)).workers[0].parts
        };
        assert_eq!(account(2), Parts { trace: 1000, wait: 500, ..Parts::default() });
        assert_eq!(account(3), Parts { trace: 1000, ..Parts::default() }, "the subtraction saturates");
    }

    #[test]
    fn disconnected_workers_are_removed() {
        let mut fading = Fading::default();
        fading.add(Duration::ZERO, &frame(1, 1, 1));
        fading.add(MEMORY, &frame(2, 1, 1));
        assert_eq!(fading.of(1), None);
        assert!(fading.of(2).is_some());
    }
}
