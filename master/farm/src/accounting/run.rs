//! The account of a whole run, as reported by `--json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::accounts::{FrameAccount, WorkerAccount};
use super::parts::Parts;

/// Workers with an account of their own; beyond that, new workers share the last one.
const MAX_WORKERS: usize = 1024;

/// Sums over the frames of a run.
#[derive(Clone, Debug, Default)]
pub struct RunAccount {
    workers: BTreeMap<u64, WorkerAccount>,
}

/// Thread time of a run, by use.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct AccountReport {
    /// All workers together.
    pub percent: Percent,
    /// Each worker, in the order in which they connected.
    pub workers: Vec<WorkerReport>,
}

/// Thread time of one worker, by use.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct WorkerReport {
    /// Number assigned by the master.
    pub id: u64,
    /// Name of the worker.
    pub name: String,
    /// Number of its render threads.
    pub threads: u32,
    /// Its thread time, in parts.
    pub percent: Percent,
    /// Segments that it delivered.
    pub segments: u32,
    /// Rows of these segments.
    pub rows: u64,
    /// Bytes of pixels on the wire.
    pub pixel_bytes: u64,
}

/// Percentages of thread time. They sum to 100, or are all zero where no time has passed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Percent {
    trace: f64,
    wait: f64,
    encode: f64,
    send: f64,
    decode: f64,
    idle_tail: f64,
    scene: f64,
}

impl Percent {
    fn of(parts: &Parts) -> Self {
        let [trace, wait, encode, send, decode, idle_tail, scene] = parts.percent();
        Self { trace, wait, encode, send, decode, idle_tail, scene }
    }
}

impl RunAccount {
    /// Adds a frame.
    pub fn add(&mut self, frame: &FrameAccount) {
        for worker in &frame.workers {
            let full = self.workers.len() >= MAX_WORKERS && !self.workers.contains_key(&worker.id);
            let known = match self.workers.last_entry().filter(|_| full) {
                Some(last) => last.into_mut(),
                None => self.workers.entry(worker.id).or_insert_with(|| {
                    let WorkerAccount { id, threads, .. } = *worker;
                    WorkerAccount { id, threads, name: worker.name.clone(), ..WorkerAccount::default() }
                }),
            };
            known.add(worker);
        }
    }

    /// The report for `--json`.
    pub fn report(&self) -> AccountReport {
        let mut sum = Parts::default();
        self.workers.values().for_each(|worker| sum.add(&worker.parts));
        let workers = self.workers.values().map(|worker| WorkerReport {
            id: worker.id,
            name: worker.name.clone(),
            threads: worker.threads,
            percent: Percent::of(&worker.parts),
            segments: worker.segments,
            rows: worker.rows,
            pixel_bytes: worker.bytes,
        });
        AccountReport { percent: Percent::of(&sum), workers: workers.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(workers: impl IntoIterator<Item = (u64, u64, u64)>) -> FrameAccount {
        let account = |(id, trace, wait)| WorkerAccount {
            id,
            name: format!("w{id}"),
            threads: 1,
            parts: Parts { trace, wait, ..Parts::default() },
            segments: 1,
            rows: 8,
            bytes: 24,
        };
        FrameAccount { workers: workers.into_iter().map(account).collect(), segments: Vec::new() }
    }

    #[test]
    fn frames_are_summed_by_worker() {
        let mut run = RunAccount::default();
        run.add(&frame([(1, 3, 1), (2, 0, 4)]));
        run.add(&frame([(1, 6, 0)]));
        let report = run.report();
        assert_eq!((report.workers[0].percent.trace, report.workers[0].percent.wait), (90.0, 10.0));
        assert_eq!((report.workers[0].segments, report.workers[0].rows), (2, 16));
        assert_eq!(report.workers[1].percent.wait, 100.0);
        assert_eq!((report.percent.trace, report.percent.wait), (64.286, 35.714));
    }

    #[test]
    fn memory_is_bounded_and_no_time_is_lost() {
        let mut run = RunAccount::default();
        for id in 0..3 * MAX_WORKERS as u64 {
            run.add(&frame([(id, 1, 0)]));
        }
        let report = run.report();
        assert_eq!(report.workers.len(), MAX_WORKERS);
        assert_eq!(report.workers.iter().map(|worker| worker.rows).sum::<u64>(), 8 * 3 * MAX_WORKERS as u64);
    }
}
