//! One frame's rows: queued, leased or done.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Range;
use std::time::Duration;

use super::forecast::Forecast;
use super::{Cost, FrameId, Lease, WorkerId};

/// Rows that wait for a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Run {
    pub(super) first: u32,
    pub(super) count: u32,
    /// Segment number and next attempt, when these rows were leased before and came back whole.
    came_back: Option<(u32, u32)>,
    /// Whether the policy `smart` has cut it already.
    pub(super) halved: bool,
}

impl Run {
    pub(super) fn new(first: u32, count: u32) -> Self {
        Self { first, count, came_back: None, halved: false }
    }
}

/// Rows that were leased.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    pub(super) first: u32,
    pub(super) count: u32,
    /// The attempt that the next lease of these rows gets.
    next_attempt: u32,
    halved: bool,
    /// Who renders it now; empty once it is done.
    pub(super) holders: BTreeSet<WorkerId>,
    pub(super) done: bool,
    /// What it took, once it is done.
    cost: Cost,
}

/// A frame that has begun.
#[derive(Debug)]
pub(super) struct Frame {
    pub(super) id: FrameId,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) forecast: Forecast,
    /// When its first lease was granted.
    pub(super) started_at: Option<Duration>,
    pub(super) queue: VecDeque<Run>,
    pub(super) segments: BTreeMap<u32, Segment>,
    next_segment: u32,
    pub(super) rows_done: u32,
    /// How often each worker has said that it cannot render this frame, since somebody last could.
    refusals: BTreeMap<WorkerId, u32>,
}

impl Frame {
    pub(super) fn new(
        id: FrameId,
        (width, height): (u32, u32),
        forecast: Forecast,
        runs: impl IntoIterator<Item = Run>,
    ) -> Self {
        Self {
            id,
            width,
            height,
            forecast,
            started_at: None,
            queue: runs.into_iter().collect(),
            segments: BTreeMap::new(),
            next_segment: 0,
            rows_done: 0,
            refusals: BTreeMap::new(),
        }
    }

    /// Rows that were leased at least once and are not queued again.
    pub(super) fn rows_leased(&self) -> u32 {
        self.height - self.queue.iter().map(|run| run.count).sum::<u32>()
    }

    /// The predicted work of the rows that wait.
    pub(super) fn waiting_work(&self) -> f64 {
        self.queue.iter().map(|run| self.forecast.work(run.first..run.first + run.count)).sum()
    }

    /// A worker says that it cannot render this frame.
    pub(super) fn refuse(&mut self, worker: WorkerId) {
        let count = self.refusals.entry(worker).or_default();
        *count = count.saturating_add(1);
    }

    /// How often a worker has said so since somebody last could.
    pub(super) fn refusals(&self, worker: WorkerId) -> u32 {
        self.refusals.get(&worker).copied().unwrap_or(0)
    }

    pub(super) fn is_complete(&self) -> bool {
        self.rows_done == self.height
    }

    /// A number that no segment of this frame has had.
    pub(super) fn next_number(&mut self) -> u32 {
        self.next_segment += 1;
        self.next_segment - 1
    }

    /// What the done segments took, summed.
    pub(super) fn cost(&self) -> Cost {
        let mut sum = Cost::default();
        self.segments.values().for_each(|segment| sum += segment.cost);
        sum
    }

    /// Leases up to `max_rows` rows from the front of the queue.
    pub(super) fn take(&mut self, worker: WorkerId, max_rows: u32) -> Option<Lease> {
        let run = self.queue.pop_front()?;
        let (run, rest) = cut(run, max_rows.max(1));
        if let Some(rest) = rest {
            self.queue.push_front(rest);
        }
        let (number, attempt) = run.came_back.unwrap_or_else(|| (self.next_number(), 0));
        let segment = Segment {
            first: run.first,
            count: run.count,
            next_attempt: attempt,
            halved: run.halved,
            holders: BTreeSet::new(),
            done: false,
            cost: Cost::default(),
        };
        self.segments.insert(number, segment);
        self.copy(number, worker)
    }

    /// Cuts the run at the front of the queue in two; a single row stays whole.
    pub(super) fn halve_front(&mut self) {
        let Some(run) = self.queue.pop_front() else { return };
        let (mut first, second) = cut(run.clone(), run.count.div_ceil(2));
        first.halved = true;
        if let Some(mut second) = second {
            second.halved = true;
            self.queue.push_front(second);
        }
        self.queue.push_front(first);
    }

    /// Leases a segment to one more worker.
    pub(super) fn copy(&mut self, number: u32, worker: WorkerId) -> Option<Lease> {
        let segment = self.segments.get_mut(&number)?;
        let attempt = segment.next_attempt;
        segment.next_attempt += 1;
        segment.holders.insert(worker);
        let (first_row, row_count) = (segment.first, segment.count);
        Some(Lease { frame: self.id, segment: number, attempt, first_row, row_count })
    }

    /// Marks the rows of a lease done; which of them were not, as runs. Every row's cost is counted once.
    ///
    /// The lease may have been taken back as overdue, and its rows be queued again or leased to others in pieces: each
    /// of these pieces lies within it.
    pub(super) fn finish(&mut self, lease: &Lease, cost: Cost) -> Vec<Range<u32>> {
        let rows = lease.first_row..lease.first_row.saturating_add(lease.row_count);
        let within = |first: u32, count: u32| rows.start <= first && first + count <= rows.end;
        for index in (0..self.queue.len()).rev() {
            if self.queue.get(index).is_some_and(|run| within(run.first, run.count)) {
                self.settle(index);
            }
        }
        let mut fresh = Vec::new();
        for segment in self.segments.values_mut().filter(|s| !s.done && within(s.first, s.count)) {
            segment.done = true;
            segment.holders.clear();
            let start = segment.first - rows.start;
            segment.cost = share(cost, start..start + segment.count, lease.row_count);
            self.rows_done += segment.count;
            fresh.push(segment.first..segment.first + segment.count);
        }
        self.refusals.clear();
        fresh.sort_unstable_by_key(|rows| rows.start);
        fresh.dedup_by(|next, run| {
            let adjoins = run.end == next.start;
            if adjoins {
                run.end = next.end;
            }
            adjoins
        });
        fresh
    }

    /// Done segments of which rows have left the picture go to the front of the queue, in order. Returns their numbers.
    pub(super) fn reject(&mut self, rows: Range<u32>) -> Vec<u32> {
        let hit = |s: &Segment| s.done && s.first < rows.end && rows.start < s.first + s.count;
        let numbers: Vec<u32> = self.segments.iter().filter(|(_, s)| hit(s)).map(|(&n, _)| n).collect();
        for &number in numbers.iter().rev() {
            let Some(Segment { first, count, next_attempt, halved, .. }) = self.segments.remove(&number)
            else {
                continue;
            };
            self.rows_done -= count;
            self.queue.push_front(Run { first, count, came_back: Some((number, next_attempt)), halved });
        }
        numbers
    }

    /// Makes a segment of a run in the queue.
    fn settle(&mut self, index: usize) {
        let Some(Run { first, count, came_back, halved }) = self.queue.remove(index) else { return };
        let (number, next_attempt) = came_back.unwrap_or_else(|| (self.next_number(), 0));
        let (holders, cost) = (BTreeSet::new(), Cost::default());
        let segment = Segment { first, count, next_attempt, halved, holders, done: false, cost };
        self.segments.insert(number, segment);
    }

    /// Takes a segment from a worker; rows that nobody else renders go back to the front of the queue.
    pub(super) fn give_up(&mut self, number: u32, worker: WorkerId) {
        let Some(segment) = self.segments.get_mut(&number) else { return };
        segment.holders.remove(&worker);
        if segment.done || !segment.holders.is_empty() {
            return;
        }
        if let Some(Segment { first, count, next_attempt, halved, .. }) = self.segments.remove(&number) {
            self.queue.push_front(Run { first, count, came_back: Some((number, next_attempt)), halved });
        }
    }
}

/// The part of a lease's cost that belongs to some of its `rows` rows. Parts of adjoining ranges sum to the whole: a lease may be
/// answered after its rows were divided.
fn share(cost: Cost, range: Range<u32>, rows: u32) -> Cost {
    let up_to = |whole: u64, row: u32| u128::from(whole) * u128::from(row) / u128::from(rows.max(1));
    let part = |whole: u64| {
        let part = up_to(whole, range.end) - up_to(whole, range.start);
        u64::try_from(part).unwrap_or(u64::MAX)
    };
    Cost {
        trace_ns: part(cost.trace_ns),
        wait_ns: part(cost.wait_ns),
        encode_ns: part(cost.encode_ns),
        span_ns: part(cost.span_ns),
        primary: part(cost.primary),
        shadow: part(cost.shadow),
        secondary: part(cost.secondary),
    }
}

/// The first `rows` rows of a run, and what is left of it. Pieces of a segment are new segments.
fn cut(run: Run, rows: u32) -> (Run, Option<Run>) {
    if run.count <= rows {
        return (run, None);
    }
    let first = Run { count: rows, came_back: None, ..run };
    let rest = Run { first: run.first + rows, count: run.count - rows, came_back: None, ..run };
    (first, Some(rest))
}

#[cfg(test)]
mod tests;
