//! Leases in the order they came, cut into bands, so that all render threads work at one lease and the next one
//! begins when the first has no more rows to give. No threads in here: [`crate::render_pool`] brings them.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::{Bytes, BytesMut};
use rayfarm_protocol::{Cost, Encoding, FrameId, Lease};

use crate::buffers::Buffers;
use crate::renderer::Counts;

/// A lease to render, with its frame `F` and whatever answers it, `A`.
#[derive(Debug)]
pub(crate) struct Job<F, A> {
    pub(crate) lease: Lease,
    pub(crate) frame: Arc<F>,
    pub(crate) answer: A,
    arrived: Instant,
    cancelled: AtomicBool,
    progress: Mutex<Progress>,
}

#[derive(Debug)]
struct Progress {
    /// Rows that no thread has taken yet, and the bytes they go to.
    rows: Range<u32>,
    room: Option<BytesMut>,
    /// When the first rows were taken.
    begun: Option<Instant>,
    /// Finished bands by their first row.
    done: BTreeMap<u32, Pixels>,
    done_rows: u32,
    cost: Cost,
}

/// The pixels of a band: as they are, at three bytes each or two where they are narrow, and as a block where blocks are wanted.
#[derive(Debug)]
pub(crate) struct Pixels {
    pub(crate) raw: BytesMut,
    pub(crate) narrow: bool,
    pub(crate) block: Option<Vec<u8>>,
}

/// How the frames of a job are cut into bands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BandShape {
    /// Rows of a band; they begin on multiples of it.
    pub(crate) rows: u32,
    pub(crate) row_bytes: usize,
}

/// What a band took.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BandCost {
    pub(crate) counts: Counts,
    pub(crate) trace: Duration,
    pub(crate) encode: Duration,
}

/// A lease whose bands are all back.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Rendered {
    pub(crate) encoding: Encoding,
    pub(crate) bytes: Bytes,
    pub(crate) cost: Cost,
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
    pub(crate) fn new(lease: Lease, rows: Range<u32>, frame: Arc<F>, answer: A, arrived: Instant) -> Self {
        let (done, cost) = (BTreeMap::new(), Cost::default());
        let progress = Mutex::new(Progress { rows, room: None, begun: None, done, done_rows: 0, cost });
        Self { lease, frame, answer, arrived, cancelled: AtomicBool::new(false), progress }
    }

    /// Asked between tiles; never taken back.
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
    fn take_band(&self, shape: BandShape, buffers: &Buffers) -> Option<(Range<u32>, BytesMut)> {
        let mut progress = self.progress();
        let Range { start, end } = progress.rows.clone();
        if start >= end || self.is_cancelled() {
            return None;
        }
        progress.begun.get_or_insert_with(Instant::now);
        let stop = (start + 1).next_multiple_of(shape.rows).min(end);
        let all_bytes = (end - start) as usize * shape.row_bytes;
        let room = progress.room.get_or_insert_with(|| buffers.take(all_bytes));
        let bytes = room.split_to((stop - start) as usize * shape.row_bytes);
        progress.rows = stop..end;
        Some((start..stop, bytes))
    }

    /// Takes a finished band back. The last one completes the lease.
    pub(crate) fn finish_band(&self, rows: Range<u32>, pixels: Pixels, cost: BandCost) -> Option<Rendered> {
        let mut progress = self.progress();
        progress.cost += cost.on_the_wire();
        progress.done_rows += rows.end - rows.start;
        progress.done.insert(rows.start, pixels);
        if progress.done_rows < self.lease.row_count || self.is_cancelled() {
            return None;
        }
        let (encoding, bytes) = whole(std::mem::take(&mut progress.done));
        let begun = progress.begun.unwrap_or(self.arrived);
        let wait_ns = nanoseconds(begun.saturating_duration_since(self.arrived));
        let span_ns = nanoseconds(begun.elapsed());
        Some(Rendered { encoding, bytes, cost: Cost { wait_ns, span_ns, ..progress.cost } })
    }
}

/// All bands from top to bottom: as blocks if every one has its own and together they are fewer bytes.
fn whole(bands: BTreeMap<u32, Pixels>) -> (Encoding, Bytes) {
    let raw_bytes: usize = bands.values().map(|band| band.raw.len()).sum();
    // The bands of one frame are all alike.
    let narrow = bands.values().any(|band| band.narrow);
    let blocks: Option<Vec<&[u8]>> = bands.values().map(|band| band.block.as_deref()).collect();
    match blocks.map(|blocks| blocks.concat()).filter(|packed| packed.len() < raw_bytes) {
        Some(packed) if narrow => (Encoding::Rgb565Lz4, packed.into()),
        Some(packed) => (Encoding::Lz4, packed.into()),
        None => {
            let mut whole = BytesMut::new();
            // Neighbours in one buffer, unless they are narrow: joining them moves no byte.
            bands.into_values().for_each(|band| whole.unsplit(band.raw));
            (if narrow { Encoding::Rgb565 } else { Encoding::Raw }, whole.freeze())
        }
    }
}

impl BandCost {
    /// Its share of a lease's cost; waiting and the span are the lease's as a whole.
    fn on_the_wire(self) -> Cost {
        let Self { counts: Counts { primary, shadow, secondary }, trace, encode } = self;
        let (trace_ns, encode_ns) = (nanoseconds(trace), nanoseconds(encode));
        Cost { trace_ns, encode_ns, primary, shadow, secondary, ..Cost::default() }
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
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
    pub(crate) fn take_band(&self, shape: impl Fn(&F) -> BandShape, buffers: &Buffers) -> Option<Band<F, A>> {
        self.jobs.iter().find_map(|job| {
            let (rows, bytes) = job.take_band(shape(&job.frame), buffers)?;
            Some(Band { job: Arc::clone(job), rows, bytes })
        })
    }

    /// Forgets a job that is complete or has failed.
    pub(crate) fn remove(&mut self, job: &Arc<Job<F, A>>) {
        self.jobs.retain(|known| !Arc::ptr_eq(known, job));
    }

    /// Cancels and forgets the jobs whose frame is `stale`. Threads in the middle of a band end at the next tile.
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
    use rayfarm_protocol::pixels::{Packer, unpack};

    use super::*;

    const WIDTH: usize = 4;
    const SHAPE: BandShape = BandShape { rows: 8, row_bytes: WIDTH * 3 };

    fn job(segment: u32, rows: Range<u32>) -> Job<(), ()> {
        let (first_row, row_count) = (rows.start, rows.end - rows.start);
        let lease = Lease { frame: FrameId(u64::from(segment)), segment, attempt: 0, first_row, row_count };
        Job::new(lease, rows, Arc::new(()), (), Instant::now())
    }

    fn take(queue: &JobQueue<(), ()>) -> Option<(u32, Range<u32>, Band<(), ()>)> {
        let band = queue.take_band(|()| SHAPE, &Buffers::default())?;
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

    /// All bands of a job, each of its rows filled with its number, the last band first.
    fn filled_bands(queue: &JobQueue<(), ()>) -> Vec<Band<(), ()>> {
        let mut bands: Vec<_> = std::iter::from_fn(|| take(queue)).map(|(_, _, band)| band).collect();
        for band in &mut bands {
            assert_eq!(band.bytes.len(), band.rows.len() * WIDTH * 3);
            for (row, line) in band.rows.clone().zip(band.bytes.chunks_mut(WIDTH * 3)) {
                line.fill(row as u8);
            }
        }
        bands.reverse();
        bands
    }

    #[test]
    fn bands_become_one_buffer_in_order_whoever_finishes_first() {
        let queue = queue([job(1, 5..20)]);
        let bands = filled_bands(&queue);
        let first = bands.last().unwrap().bytes.as_ptr();
        let last = bands.len() - 1;
        for (index, Band { job, rows, bytes }) in bands.into_iter().enumerate() {
            let counts = Counts { primary: 2, shadow: 3, secondary: 4 };
            let cost = BandCost { counts, trace: Duration::from_nanos(5), encode: Duration::from_nanos(1) };
            let Some(rendered) =
                job.finish_band(rows, Pixels { raw: bytes, narrow: false, block: None }, cost)
            else {
                assert!(index < last);
                continue;
            };
            assert_eq!(index, last);
            let Cost { trace_ns, encode_ns, primary, shadow, secondary, .. } = rendered.cost;
            assert_eq!((trace_ns, encode_ns, primary, shadow, secondary), (15, 3, 6, 9, 12));
            assert_eq!((rendered.encoding, &rendered.bytes), (Encoding::Raw, &expected(5..20)));
            assert_eq!(rendered.bytes.as_ptr(), first, "the bands were copied");
        }
    }

    fn expected(rows: Range<u32>) -> Bytes {
        rows.flat_map(|row| [row as u8; WIDTH * 3]).collect()
    }

    #[test]
    fn blocks_are_sent_where_they_are_fewer_bytes() {
        for (first_row, encoding) in [(0, Encoding::Lz4), (5, Encoding::Raw)] {
            let queue = queue([job(1, first_row..24)]);
            let mut packer = Packer::new();
            let rendered = filled_bands(&queue).into_iter().find_map(|Band { job, rows, bytes }| {
                // A block of one's own for each row makes them more than the rows.
                let part = if first_row == 0 { bytes.len() } else { 3 };
                let block = bytes.chunks(part).flat_map(|part| packer.block(part).unwrap()).collect();
                job.finish_band(
                    rows,
                    Pixels { raw: bytes, narrow: false, block: Some(block) },
                    BandCost::default(),
                )
            });
            let Rendered { encoding: chosen, bytes, .. } = rendered.unwrap();
            let expected = expected(first_row..24);
            assert_eq!((chosen, bytes.len() < expected.len()), (encoding, encoding == Encoding::Lz4));
            let mut rows = vec![0; expected.len()];
            match chosen {
                Encoding::Lz4 => unpack(&bytes, &mut rows).unwrap(),
                Encoding::Raw => rows.copy_from_slice(&bytes),
                Encoding::Rgb565 | Encoding::Rgb565Lz4 => panic!("these bands are not narrow"),
            }
            assert_eq!(rows, expected);
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
        let pixels = Pixels { raw: single.bytes, narrow: false, block: None };
        assert!(single.job.finish_band(single.rows, pixels, BandCost::default()).is_none());
    }

    #[test]
    fn only_one_caller_cancels() {
        let job = job(1, 0..8);
        assert!(job.cancel());
        assert!(!job.cancel());
    }
}
