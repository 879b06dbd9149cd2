//! Queue of leases in order of arrival, cut into bands of rows. All render threads work on one lease, and the next lease
//! begins when all rows of the first are taken. The queue has no threads; [`RenderPool`](super::RenderPool) has them.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::{Bytes, BytesMut};
use rayfarm_protocol::{Cost, Encoding, FrameId, Lease};

use super::buffers::BufferPool;
use crate::renderer::RayCounts;

/// A lease to render, with its frame `F` and the receiver of its result, `A`.
#[derive(Debug)]
pub(crate) struct Job<F, A> {
    pub(super) lease: Lease,
    pub(super) frame: Arc<F>,
    pub(super) reply: A,
    arrived: Instant,
    cancelled: AtomicBool,
    progress: Mutex<Progress>,
}

#[derive(Debug)]
struct Progress {
    /// Rows that no thread has taken yet.
    rows: Range<u32>,
    /// Buffer of those rows.
    buffer: Option<BytesMut>,
    /// Time when the first rows were taken.
    begun: Option<Instant>,
    /// Finished bands by their first row.
    done: BTreeMap<u32, BandPixels>,
    done_rows: u32,
    cost: Cost,
}

/// Encoded pixels of a band.
#[derive(Debug)]
pub(super) struct BandPixels {
    /// Uncompressed pixels.
    pub(super) raw: BytesMut,
    /// Encoding of the uncompressed pixels.
    pub(super) plain: Encoding,
    /// The same pixels as a block of LZ4, where compression is on.
    pub(super) block: Option<Vec<u8>>,
    /// Encoding of the block.
    pub(super) blocks: Encoding,
}

/// Division of a frame into bands.
#[derive(Clone, Copy, Debug)]
pub(super) struct BandShape {
    /// Number of rows of a band. Bands begin at its multiples.
    pub(super) rows: u32,
    /// Number of bytes of a row.
    pub(super) row_bytes: usize,
}

/// Time and rays that a band has taken.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BandCost {
    pub(super) counts: RayCounts,
    pub(super) trace: Duration,
    pub(super) encode: Duration,
}

/// A lease whose bands are all finished.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Rendered {
    pub(super) encoding: Encoding,
    pub(super) bytes: Bytes,
    pub(super) cost: Cost,
}

/// Rows of a job for one thread, with their exclusive part of the job's buffer.
#[derive(Debug)]
pub(super) struct Band<F, A> {
    pub(super) job: Arc<Job<F, A>>,
    pub(super) rows: Range<u32>,
    pub(super) bytes: BytesMut,
}

impl<F, A> Job<F, A> {
    /// Makes a job of a lease, its rows, and the time of its arrival.
    pub(crate) fn new(lease: Lease, rows: Range<u32>, frame: Arc<F>, reply: A, arrived: Instant) -> Self {
        let (done, cost) = (BTreeMap::new(), Cost::default());
        let progress = Mutex::new(Progress { rows, buffer: None, begun: None, done, done_rows: 0, cost });
        Self { lease, frame, reply, arrived, cancelled: AtomicBool::new(false), progress }
    }

    /// Whether the job is cancelled, which is permanent. Polled between tiles.
    pub(super) fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Cancels the job. Returns `true` to the first caller only.
    pub(super) fn cancel(&self) -> bool {
        !self.cancelled.swap(true, Ordering::Relaxed)
    }

    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the next rows, with their part of the buffer, which is allocated with the first rows.
    fn take_band(&self, shape: BandShape, buffers: &BufferPool) -> Option<(Range<u32>, BytesMut)> {
        let mut progress = self.progress();
        let Range { start, end } = progress.rows.clone();
        if start >= end || self.is_cancelled() {
            return None;
        }
        progress.begun.get_or_insert_with(Instant::now);
        let stop = (start + 1).next_multiple_of(shape.rows).min(end);
        let all_bytes = (end - start) as usize * shape.row_bytes;
        let buffer = progress.buffer.get_or_insert_with(|| buffers.acquire(all_bytes));
        let bytes = buffer.split_to((stop - start) as usize * shape.row_bytes);
        progress.rows = stop..end;
        Some((start..stop, bytes))
    }

    /// Adds a finished band. The last one completes the lease.
    pub(super) fn finish_band(
        &self,
        rows: Range<u32>,
        pixels: BandPixels,
        cost: BandCost,
    ) -> Option<Rendered> {
        let mut progress = self.progress();
        progress.cost += cost.to_cost();
        progress.done_rows += rows.end - rows.start;
        progress.done.insert(rows.start, pixels);
        if progress.done_rows < self.lease.row_count || self.is_cancelled() {
            return None;
        }
        let (encoding, bytes) = join_bands(std::mem::take(&mut progress.done));
        let begun = progress.begun.unwrap_or(self.arrived);
        let wait_ns = nanoseconds(begun.saturating_duration_since(self.arrived));
        let span_ns = nanoseconds(begun.elapsed());
        Some(Rendered { encoding, bytes, cost: Cost { wait_ns, span_ns, ..progress.cost } })
    }
}

/// Joins the bands from top to bottom: as blocks where all bands have one and the blocks have fewer bytes, uncompressed
/// otherwise.
fn join_bands(bands: BTreeMap<u32, BandPixels>) -> (Encoding, Bytes) {
    let raw_bytes: usize = bands.values().map(|band| band.raw.len()).sum();
    // All bands of a frame have the same encodings.
    let encodings = bands.values().next().map(|band| (band.plain, band.blocks));
    let (plain, encoding) = encodings.unwrap_or((Encoding::Raw, Encoding::Lz4));
    let blocks: Option<Vec<&[u8]>> = bands.values().map(|band| band.block.as_deref()).collect();
    match blocks.map(|blocks| blocks.concat()).filter(|packed| packed.len() < raw_bytes) {
        Some(packed) => (encoding, packed.into()),
        None => {
            let mut joined = BytesMut::new();
            // Bands are adjacent in one buffer, unless they are RGB 5-6-5, so this moves no byte.
            bands.into_values().for_each(|band| joined.unsplit(band.raw));
            (plain, joined.freeze())
        }
    }
}

impl BandCost {
    /// Converts to a share of the lease's cost. Waiting and span are measured for the whole lease.
    fn to_cost(self) -> Cost {
        let Self { counts: RayCounts { primary, shadow, secondary }, trace, encode } = self;
        let (trace_ns, encode_ns) = (nanoseconds(trace), nanoseconds(encode));
        Cost { trace_ns, encode_ns, primary, shadow, secondary, ..Cost::default() }
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

/// Jobs from their arrival until their last band is finished.
#[derive(Debug)]
pub(super) struct JobQueue<F, A> {
    jobs: Vec<Arc<Job<F, A>>>,
}

impl<F, A> JobQueue<F, A> {
    pub(super) fn new() -> Self {
        Self { jobs: Vec::new() }
    }

    pub(super) fn push(&mut self, job: Job<F, A>) {
        self.jobs.push(Arc::new(job));
    }

    /// Takes rows of the earliest job that has rows left.
    pub(super) fn take_band(
        &self,
        shape: impl Fn(&F) -> BandShape,
        buffers: &BufferPool,
    ) -> Option<Band<F, A>> {
        self.jobs.iter().find_map(|job| {
            let (rows, bytes) = job.take_band(shape(&job.frame), buffers)?;
            Some(Band { job: Arc::clone(job), rows, bytes })
        })
    }

    /// Removes a job that is complete or has failed.
    pub(super) fn remove(&mut self, job: &Arc<Job<F, A>>) {
        self.jobs.retain(|known| !Arc::ptr_eq(known, job));
    }

    /// Cancels and removes the jobs whose frame is `stale`. Threads within a band end at the next tile.
    pub(super) fn cancel(&mut self, stale: impl Fn(FrameId) -> bool) {
        self.jobs.retain(|job| {
            let is_stale = stale(job.lease.frame);
            if is_stale {
                job.cancel();
            }
            !is_stale
        });
    }

    pub(super) fn len(&self) -> usize {
        self.jobs.len()
    }
}

#[cfg(test)]
mod tests {
    use rayfarm_protocol::pixels::{Packer, PixelFormat, unpack};

    use super::*;

    const ROW_BYTES: usize = PixelFormat::Rgb8.row_bytes(4);
    fn band(raw: BytesMut, block: Option<Vec<u8>>) -> BandPixels {
        BandPixels { raw, plain: Encoding::Raw, block, blocks: Encoding::Lz4 }
    }

    const SHAPE: BandShape = BandShape { rows: 8, row_bytes: ROW_BYTES };

    fn job(segment: u32, rows: Range<u32>) -> Job<(), ()> {
        let (first_row, row_count) = (rows.start, rows.end - rows.start);
        let lease = Lease { frame: FrameId(u64::from(segment)), segment, attempt: 0, first_row, row_count };
        Job::new(lease, rows, Arc::new(()), (), Instant::now())
    }

    fn take(queue: &JobQueue<(), ()>) -> Option<(u32, Range<u32>, Band<(), ()>)> {
        let band = queue.take_band(|()| SHAPE, &BufferPool::default())?;
        Some((band.job.lease.segment, band.rows.clone(), band))
    }

    fn queue(jobs: impl IntoIterator<Item = Job<(), ()>>) -> JobQueue<(), ()> {
        let mut queue = JobQueue::new();
        jobs.into_iter().for_each(|job| queue.push(job));
        queue
    }

    #[test]
    fn bands_end_at_multiples_and_jobs_are_taken_in_order() {
        let queue = queue([job(1, 5..20), job(2, 20..21)]);
        let taken: Vec<_> =
            std::iter::from_fn(|| take(&queue).map(|(segment, rows, _)| (segment, rows))).collect();
        assert_eq!(taken, [(1, 5..8), (1, 8..16), (1, 16..20), (2, 20..21)]);
    }

    /// Takes all bands of a job, last band first, and fills each row with its number.
    fn filled_bands(queue: &JobQueue<(), ()>) -> Vec<Band<(), ()>> {
        let mut bands: Vec<_> = std::iter::from_fn(|| take(queue)).map(|(_, _, band)| band).collect();
        for band in &mut bands {
            assert_eq!(band.bytes.len(), band.rows.len() * ROW_BYTES);
            for (row, line) in band.rows.clone().zip(band.bytes.chunks_mut(ROW_BYTES)) {
                line.fill(row as u8);
            }
        }
        bands.reverse();
        bands
    }

    #[test]
    fn bands_join_in_order_whichever_finishes_first() {
        let queue = queue([job(1, 5..20)]);
        let bands = filled_bands(&queue);
        let first = bands.last().unwrap().bytes.as_ptr();
        let last = bands.len() - 1;
        for (index, Band { job, rows, bytes }) in bands.into_iter().enumerate() {
            let counts = RayCounts { primary: 2, shadow: 3, secondary: 4 };
            let cost = BandCost { counts, trace: Duration::from_nanos(5), encode: Duration::from_nanos(1) };
            let Some(rendered) = job.finish_band(rows, band(bytes, None), cost) else {
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
        rows.flat_map(|row| [row as u8; ROW_BYTES]).collect()
    }

    #[test]
    fn blocks_are_sent_where_they_have_fewer_bytes() {
        for (first_row, encoding) in [(0, Encoding::Lz4), (5, Encoding::Raw)] {
            let queue = queue([job(1, first_row..24)]);
            let mut packer = Packer::new();
            let rendered = filled_bands(&queue).into_iter().find_map(|Band { job, rows, bytes }| {
                // Blocks of three bytes each have more bytes than the rows.
                let part = if first_row == 0 { bytes.len() } else { 3 };
                let block = bytes.chunks(part).flat_map(|part| packer.block(part).unwrap()).collect();
                job.finish_band(rows, band(bytes, Some(block)), BandCost::default())
            });
            let Rendered { encoding: chosen, bytes, .. } = rendered.unwrap();
            let expected = expected(first_row..24);
            assert_eq!((chosen, bytes.len() < expected.len()), (encoding, encoding == Encoding::Lz4));
            let mut rows = vec![0; expected.len()];
            match chosen {
                Encoding::Lz4 => unpack(&bytes, &mut rows).unwrap(),
                Encoding::Raw => rows.copy_from_slice(&bytes),
                Encoding::Rgb565 | Encoding::Rgb565Lz4 | Encoding::PlanesLz4 => panic!("{chosen:?} of RGB8"),
            }
            assert_eq!(rows, expected);
        }
    }

    #[test]
    fn a_cancelled_job_yields_no_rows_and_no_pixels() {
        let mut queue = queue([job(1, 0..16), job(2, 0..16)]);
        let (_, _, running) = take(&queue).unwrap();
        queue.cancel(|frame| frame < FrameId(2));
        assert!(running.job.is_cancelled());
        assert_eq!(take(&queue).unwrap().0, 2);
        assert_eq!(queue.len(), 1);
        let single = Band { rows: 0..16, ..running };
        let pixels = band(single.bytes, None);
        assert!(single.job.finish_band(single.rows, pixels, BandCost::default()).is_none());
    }

    #[test]
    fn only_the_first_cancel_returns_true() {
        let job = job(1, 0..8);
        assert!(job.cancel());
        assert!(!job.cancel());
    }
}
