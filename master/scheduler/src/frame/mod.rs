//! Rows of one frame: queued, leased or done.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Range;
use std::time::Duration;

use super::forecast::Forecast;
use super::{Cost, FrameId, Lease, WorkerId};

/// Queued rows: a range that waits for a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct RowRange {
    pub(super) first: u32,
    pub(super) count: u32,
    /// Segment number and next attempt, if these rows were leased before as one segment.
    requeued_as: Option<(u32, u32)>,
    /// Whether the policy `smart` has halved it already.
    pub(super) halved: bool,
}

impl RowRange {
    pub(super) fn new(first: u32, count: u32) -> Self {
        Self { first, count, requeued_as: None, halved: false }
    }
}

/// Leased or finished rows.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    pub(super) first: u32,
    pub(super) count: u32,
    /// Attempt number of the next lease of these rows.
    next_attempt: u32,
    halved: bool,
    /// Workers that hold it; empty once it is done.
    pub(super) holders: BTreeSet<WorkerId>,
    pub(super) done: bool,
    /// Its cost, once it is done.
    cost: Cost,
}

/// A frame in flight.
#[derive(Debug)]
pub(super) struct Frame {
    pub(super) id: FrameId,
    pub(super) width: u32,
    pub(super) height: u32,
    /// Largest number of rows of one lease.
    pub(super) max_rows: u32,
    pub(super) forecast: Forecast,
    /// Time of its first lease.
    pub(super) started_at: Option<Duration>,
    pub(super) queue: VecDeque<RowRange>,
    pub(super) segments: BTreeMap<u32, Segment>,
    next_segment: u32,
    pub(super) rows_done: u32,
    /// Rows that were leased to workers on probation, each time that they were.
    pub(super) rows_on_probation: u32,
    /// Refusals of this frame per worker since the last finished segment.
    refusals: BTreeMap<WorkerId, u32>,
}

impl Frame {
    pub(super) fn new(
        id: FrameId,
        (width, height): (u32, u32),
        forecast: Forecast,
        ranges: impl IntoIterator<Item = RowRange>,
    ) -> Self {
        Self {
            id,
            width,
            height,
            max_rows: u32::MAX,
            forecast,
            started_at: None,
            queue: ranges.into_iter().collect(),
            segments: BTreeMap::new(),
            next_segment: 0,
            rows_done: 0,
            rows_on_probation: 0,
            refusals: BTreeMap::new(),
        }
    }

    /// The frame with a limit of the rows of one lease.
    pub(super) fn with_max_rows(self, max_rows: u32) -> Self {
        Self { max_rows, ..self }
    }

    /// Number of rows that are not queued.
    pub(super) fn rows_leased(&self) -> u32 {
        self.height - self.queue.iter().map(|range| range.count).sum::<u32>()
    }

    /// Predicted work of the queued rows.
    pub(super) fn queued_work(&self) -> f64 {
        self.queue.iter().map(|range| self.forecast.work(range.first..range.first + range.count)).sum()
    }

    /// Counts a refusal: a worker cannot render this frame.
    pub(super) fn refuse(&mut self, worker: WorkerId) {
        let count = self.refusals.entry(worker).or_default();
        *count = count.saturating_add(1);
    }

    /// Refusals of a worker since the last finished segment.
    pub(super) fn refusals(&self, worker: WorkerId) -> u32 {
        self.refusals.get(&worker).copied().unwrap_or(0)
    }

    pub(super) fn is_complete(&self) -> bool {
        self.rows_done == self.height
    }

    /// A segment number that is new in this frame.
    pub(super) fn next_number(&mut self) -> u32 {
        self.next_segment += 1;
        self.next_segment - 1
    }

    /// Sum of the costs of the done segments.
    pub(super) fn cost(&self) -> Cost {
        let mut sum = Cost::default();
        self.segments.values().for_each(|segment| sum += segment.cost);
        sum
    }

    /// Leases up to `max_rows` rows from the front of the queue.
    pub(super) fn lease_front(&mut self, worker: WorkerId, max_rows: u32) -> Option<Lease> {
        let range = self.queue.pop_front()?;
        let (range, rest) = cut(range, max_rows.max(1));
        if let Some(rest) = rest {
            self.queue.push_front(rest);
        }
        let (number, attempt) = range.requeued_as.unwrap_or_else(|| (self.next_number(), 0));
        let segment = Segment {
            first: range.first,
            count: range.count,
            next_attempt: attempt,
            halved: range.halved,
            holders: BTreeSet::new(),
            done: false,
            cost: Cost::default(),
        };
        self.segments.insert(number, segment);
        self.lease_to(number, worker)
    }

    /// Halves the range at the front of the queue; a single row stays whole.
    pub(super) fn halve_front(&mut self) {
        let Some(range) = self.queue.pop_front() else { return };
        let (mut first, second) = cut(range.clone(), range.count.div_ceil(2));
        first.halved = true;
        if let Some(mut second) = second {
            second.halved = true;
            self.queue.push_front(second);
        }
        self.queue.push_front(first);
    }

    /// Leases a segment to one more worker.
    pub(super) fn lease_to(&mut self, number: u32, worker: WorkerId) -> Option<Lease> {
        let segment = self.segments.get_mut(&number)?;
        let attempt = segment.next_attempt;
        segment.next_attempt += 1;
        segment.holders.insert(worker);
        let (first_row, row_count) = (segment.first, segment.count);
        Some(Lease { frame: self.id, segment: number, attempt, first_row, row_count })
    }

    /// Marks the rows of a lease done. Returns those that were not done before, as disjoint ranges in order. Every row's
    /// cost counts once.
    ///
    /// The lease may have been revoked as overdue, and its rows be queued again or leased to others in pieces: each of
    /// these pieces is within it.
    pub(super) fn finish(&mut self, lease: &Lease, cost: Cost) -> Vec<Range<u32>> {
        let rows = lease.first_row..lease.first_row.saturating_add(lease.row_count);
        let within = |first: u32, count: u32| rows.start <= first && first + count <= rows.end;
        for index in (0..self.queue.len()).rev() {
            if self.queue.get(index).is_some_and(|range| within(range.first, range.count)) {
                self.promote(index);
            }
        }
        let mut fresh = Vec::new();
        for segment in self.segments.values_mut().filter(|s| !s.done && within(s.first, s.count)) {
            segment.done = true;
            segment.holders.clear();
            let start = segment.first - rows.start;
            segment.cost = cost_share(cost, start..start + segment.count, lease.row_count);
            self.rows_done += segment.count;
            fresh.push(segment.first..segment.first + segment.count);
        }
        self.refusals.clear();
        fresh.sort_unstable_by_key(|rows| rows.start);
        fresh.dedup_by(|next, range| {
            let adjoins = range.end == next.start;
            if adjoins {
                range.end = next.end;
            }
            adjoins
        });
        fresh
    }

    /// Requeues done segments that overlap rejected rows, in order, at the front. Returns their numbers.
    pub(super) fn reject(&mut self, rows: Range<u32>) -> Vec<u32> {
        let hit = |s: &Segment| s.done && s.first < rows.end && rows.start < s.first + s.count;
        let numbers: Vec<u32> = self.segments.iter().filter(|(_, s)| hit(s)).map(|(&n, _)| n).collect();
        for &number in numbers.iter().rev() {
            let Some(Segment { first, count, next_attempt, halved, .. }) = self.segments.remove(&number)
            else {
                continue;
            };
            self.rows_done -= count;
            self.queue.push_front(RowRange {
                first,
                count,
                requeued_as: Some((number, next_attempt)),
                halved,
            });
        }
        numbers
    }

    /// Makes a segment of the queued range at `index`.
    fn promote(&mut self, index: usize) {
        let Some(RowRange { first, count, requeued_as, halved }) = self.queue.remove(index) else { return };
        let (number, next_attempt) = requeued_as.unwrap_or_else(|| (self.next_number(), 0));
        let (holders, cost) = (BTreeSet::new(), Cost::default());
        let segment = Segment { first, count, next_attempt, halved, holders, done: false, cost };
        self.segments.insert(number, segment);
    }

    /// Removes a holder of a segment; rows without another holder go back to the front of the queue.
    pub(super) fn release(&mut self, number: u32, worker: WorkerId) {
        let Some(segment) = self.segments.get_mut(&number) else { return };
        segment.holders.remove(&worker);
        if segment.done || !segment.holders.is_empty() {
            return;
        }
        if let Some(Segment { first, count, next_attempt, halved, .. }) = self.segments.remove(&number) {
            self.queue.push_front(RowRange {
                first,
                count,
                requeued_as: Some((number, next_attempt)),
                halved,
            });
        }
    }
}

/// The part of a lease's cost that belongs to a range of its `rows` rows. Parts of adjoining ranges sum to the whole: the
/// rows of a lease may have been divided before it is answered.
fn cost_share(cost: Cost, range: Range<u32>, rows: u32) -> Cost {
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

/// Cuts a range after `rows` rows. Pieces of a former segment become new segments.
fn cut(range: RowRange, rows: u32) -> (RowRange, Option<RowRange>) {
    if range.count <= rows {
        return (range, None);
    }
    let first = RowRange { count: rows, requeued_as: None, ..range };
    let rest = RowRange { first: range.first + rows, count: range.count - rows, requeued_as: None, ..range };
    (first, Some(rest))
}

#[cfg(test)]
mod tests;
