//! Leases in the order they came, cut into bands, so that all render threads work at one lease and the next one
//! begins when the first has no more rows to give. No threads in here: [`crate::render_pool`] brings them.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::{Bytes, BytesMut};
use rayfarm_protocol::{Cost, FrameId, Lease};

use crate::renderer::Counts;

/// A lease to render, with its frame `F` and whatever answers it, `A`.
#[derive(Debug)]
pub(crate) struct Job<F, A> {
    pub(crate) lease: Lease,
    pub(crate) frame: Arc<F>,
    pub(crate) answer: A,
    cancelled: AtomicBool,
    progress: Mutex<Progress>,
}

#[derive(Debug)]
struct Progress {
    /// Rows that no thread has taken yet, and the bytes they go to.
    rows: Range<u32>,
    room: Option<BytesMut>,
    /// Finished bands by their first row.
    done: BTreeMap<u32, BytesMut>,
    done_rows: u32,
    cost: Cost,
}

/// Rows of a job for one thread. `bytes` is theirs alone, and a part of the job's one buffer.
#[derive(Debug)]
pub(crate) struct Band<F, A> {
    pub(crate) job: Arc<Job<F, A>>,
    pub(crate) rows: Range<u32>,
    pub(crate) bytes: BytesMut,
}

impl<F, A> Job<F, A> {
    /// `rows` are the lease's.
    pub(crate) fn new(lease: Lease, rows: Range<u32>, frame: Arc<F>, answer: A) -> Self {
        let progress =
            Progress { rows, room: None, done: BTreeMap::new(), done_rows: 0, cost: Cost::default() };
        Self { lease, frame, answer, cancelled: AtomicBool::new(false), progress: Mutex::new(progress) }
    }

    /// Asked between bands of rows; never taken back.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// `true` for the one caller who cancelled it.
    pub(crate) fn cancel(&self) -> bool {
        !self.cancelled.swap(true, Ordering::Relaxed)
    }

    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next rows that nobody has; the buffer is made when the first ones are taken.
    fn take_band(&self, band_rows: u32, row_bytes: usize) -> Option<(Range<u32>, BytesMut)> {
        let mut progress = self.progress();
        let Range { start, end } = progress.rows.clone();
        if start >= end || self.is_cancelled() {
            return None;
        }
        let stop = (start + 1).next_multiple_of(band_rows).min(end);
        let all_bytes = (end - start) as usize * row_bytes;
        let room = progress.room.get_or_insert_with(|| BytesMut::zeroed(all_bytes));
        let bytes = room.split_to((stop - start) as usize * row_bytes);
        progress.rows = stop..end;
        Some((start..stop, bytes))
    }

    /// Takes a finished band back. The last one completes the lease: all its bytes, and what it cost.
    pub(crate) fn finish_band(
        &self,
        rows: Range<u32>,
        bytes: BytesMut,
        counts: Counts,
        trace_ns: u64,
    ) -> Option<(Bytes, Cost)> {
        let mut progress = self.progress();
        add(&mut progress.cost, counts, trace_ns);
        progress.done_rows += rows.end - rows.start;
        progress.done.insert(rows.start, bytes);
        if progress.done_rows < self.lease.row_count || self.is_cancelled() {
            return None;
        }
        let mut whole = BytesMut::new();
        for (_, band) in std::mem::take(&mut progress.done) {
            // Neighbours in one buffer: joining them moves no byte.
            whole.unsplit(band);
        }
        Some((whole.freeze(), progress.cost))
    }
}

fn add(cost: &mut Cost, counts: Counts, trace_ns: u64) {
    cost.trace_ns = cost.trace_ns.saturating_add(trace_ns);
    cost.primary = cost.primary.saturating_add(counts.primary);
    cost.shadow = cost.shadow.saturating_add(counts.shadow);
    cost.secondary = cost.secondary.saturating_add(counts.secondary);
}

/// Jobs from their arrival until their last band is back.
#[derive(Debug)]
pub(crate) struct JobQueue<F, A> {
    jobs: Vec<Arc<Job<F, A>>>,
}

impl<F, A> JobQueue<F, A> {
    pub(crate) fn new() -> Self {
        Self { jobs: Vec::new() }
    }

    pub(crate) fn push(&mut self, job: Job<F, A>) {
        self.jobs.push(Arc::new(job));
    }

    /// Rows of the earliest job that still has some.
    pub(crate) fn take_band(&self, band_rows: u32, row_bytes: impl Fn(&F) -> usize) -> Option<Band<F, A>> {
        self.jobs.iter().find_map(|job| {
            let (rows, bytes) = job.take_band(band_rows, row_bytes(&job.frame))?;
            Some(Band { job: Arc::clone(job), rows, bytes })
        })
    }

    /// Forgets a job that is complete or has failed.
    pub(crate) fn remove(&mut self, job: &Arc<Job<F, A>>) {
        self.jobs.retain(|known| !Arc::ptr_eq(known, job));
    }

    /// Cancels and forgets the jobs whose frame is `stale`. Threads in the middle of a band end at the next row boundary.
    pub(crate) fn cancel(&mut self, stale: impl Fn(FrameId) -> bool) {
        self.jobs.retain(|job| {
            let is_stale = stale(job.lease.frame);
            if is_stale {
                job.cancel();
            }
            !is_stale
        });
    }

    pub(crate) fn len(&self) -> usize {
        self.jobs.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 4;

    fn job(segment: u32, rows: Range<u32>) -> Job<(), ()> {
        let (first_row, row_count) = (rows.start, rows.end - rows.start);
        let lease = Lease { frame: FrameId(u64::from(segment)), segment, attempt: 0, first_row, row_count };
        Job::new(lease, rows, Arc::new(()), ())
    }

    fn take(queue: &JobQueue<(), ()>) -> Option<(u32, Range<u32>, Band<(), ()>)> {
        let band = queue.take_band(8, |()| WIDTH * 3)?;
        Some((band.job.lease.segment, band.rows.clone(), band))
    }

    fn queue(jobs: impl IntoIterator<Item = Job<(), ()>>) -> JobQueue<(), ()> {
        let mut queue = JobQueue::new();
        jobs.into_iter().for_each(|job| queue.push(job));
        queue
    }

    #[test]
    fn bands_end_on_multiples_and_jobs_follow_each_other() {
        let queue = queue([job(1, 5..20), job(2, 20..21)]);
        let taken: Vec<_> =
            std::iter::from_fn(|| take(&queue).map(|(segment, rows, _)| (segment, rows))).collect();
        assert_eq!(taken, [(1, 5..8), (1, 8..16), (1, 16..20), (2, 20..21)]);
    }

    #[test]
    fn bands_become_one_buffer_in_order_whoever_finishes_first() {
        let queue = queue([job(1, 5..20)]);
        let mut bands: Vec<_> = std::iter::from_fn(|| take(&queue)).map(|(_, _, band)| band).collect();
        let first = bands[0].bytes.as_ptr();
        bands.reverse();
        let last = bands.len() - 1;
        for (index, Band { job, rows, mut bytes }) in bands.into_iter().enumerate() {
            assert_eq!(bytes.len(), rows.len() * WIDTH * 3);
            for (row, line) in rows.clone().zip(bytes.chunks_mut(WIDTH * 3)) {
                line.fill(row as u8);
            }
            let counts = Counts { primary: 2, shadow: 3, secondary: 4 };
            match job.finish_band(rows, bytes, counts, 5) {
                None => assert!(index < last),
                Some((whole, cost)) => {
                    assert_eq!(index, last);
                    assert_eq!(cost, Cost { trace_ns: 15, primary: 6, shadow: 9, secondary: 12 });
                    let expected: Vec<u8> = (5..20).flat_map(|row| [row; WIDTH * 3]).collect();
                    assert_eq!(whole, expected);
                    assert_eq!(whole.as_ptr(), first, "the bands were copied");
                }
            }
        }
    }

    #[test]
    fn cancelled_jobs_give_no_rows_and_no_pixels() {
        let mut queue = queue([job(1, 0..16), job(2, 0..16)]);
        let (_, _, running) = take(&queue).unwrap();
        queue.cancel(|frame| frame < FrameId(2));
        assert!(running.job.is_cancelled());
        assert_eq!(take(&queue).unwrap().0, 2);
        assert_eq!(queue.len(), 1);
        let single = Band { rows: 0..16, ..running };
        assert!(single.job.finish_band(single.rows, single.bytes, Counts::default(), 0).is_none());
    }

    #[test]
    fn only_one_caller_cancels() {
        let job = job(1, 0..8);
        assert!(job.cancel());
        assert!(!job.cancel());
    }
}
