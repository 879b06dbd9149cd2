//! The render threads. They are plain system threads, so that rendering and networking never wait for each other.

mod buffers;
mod gain;
mod job_queue;

use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use rayfarm_protocol::pixels::{self, Packer};
use rayfarm_protocol::{Encoding, FrameId, PixelFormat, PixelsHeader, ToMaster};
use tokio::sync::mpsc;

use crate::catch_panic::catch_panic;
use crate::progress::ProgressFlag;
use crate::renderer::{Cancelled, Renderer};

use buffers::BufferPool;
pub(crate) use gain::Gain;
use job_queue::{Band, BandCost, BandPixels, BandShape, Job, JobQueue, Rendered};

/// Receiver of the results of a session's leases.
#[derive(Clone, Debug)]
pub(crate) struct JobReply {
    /// Finished segments. The channel is bounded: render threads wait for a slow network.
    pub(crate) pixels: mpsc::Sender<ToMaster>,
    /// Frames that failed because of a bug, with the reason.
    pub(crate) failures: mpsc::UnboundedSender<(FrameId, String)>,
    /// Whether pixels are compressed where that makes them fewer bytes.
    pub(crate) compress: bool,
}

/// A prepared frame, shared by its jobs.
#[derive(Debug)]
pub(crate) struct ReadyFrame<F> {
    pub(crate) frame: F,
    /// Number of pixels per row.
    pub(crate) width: u32,
    /// Format of the pixels.
    pub(crate) format: PixelFormat,
    /// Whether the pixels are sent as RGB 5-6-5.
    pub(crate) rgb565: bool,
    /// What compression has gained so far.
    pub(crate) gain: Gain,
}

/// A lease for the render pool.
pub(crate) type PoolJob<R> = Job<ReadyFrame<<R as Renderer>::Frame>, JobReply>;

type PoolBand<R> = Band<ReadyFrame<<R as Renderer>::Frame>, JobReply>;
type PoolQueue<R> = JobQueue<ReadyFrame<<R as Renderer>::Frame>, JobReply>;

/// A fixed number of render threads, which end with the pool.
pub(crate) struct RenderPool<R: Renderer> {
    shared: Arc<Shared<R>>,
}

struct Shared<R: Renderer> {
    renderer: Arc<R>,
    state: Mutex<State<R>>,
    work: Condvar,
    buffers: BufferPool,
    progress: ProgressFlag,
}

struct State<R: Renderer> {
    queue: PoolQueue<R>,
    stopping: bool,
}

impl<R: Renderer> RenderPool<R> {
    /// Starts the threads.
    ///
    /// # Errors
    /// A system that starts no more threads.
    pub(crate) fn new(renderer: Arc<R>, threads: usize) -> io::Result<Self> {
        let state = Mutex::new(State { queue: JobQueue::new(), stopping: false });
        let (buffers, progress) = (BufferPool::default(), ProgressFlag::default());
        let shared = Arc::new(Shared { renderer, state, work: Condvar::new(), buffers, progress });
        let pool = Self { shared };
        for index in 0..threads {
            let shared = Arc::clone(&pool.shared);
            std::thread::Builder::new().name(format!("render-{index}")).spawn(move || shared.run())?;
        }
        Ok(pool)
    }

    /// Queues a job.
    pub(crate) fn submit(&self, job: PoolJob<R>) {
        self.shared.state().queue.push(job);
        self.shared.work.notify_all();
    }

    /// Number of jobs that are queued or being rendered.
    pub(crate) fn len(&self) -> usize {
        self.shared.state().queue.len()
    }

    /// The flag that the render threads set as they go on. Other work for the same master sets it as well.
    pub(crate) fn progress(&self) -> &ProgressFlag {
        &self.shared.progress
    }

    /// Cancels the jobs of every stale frame. Those being rendered end at the next tile.
    pub(crate) fn cancel(&self, stale: impl Fn(FrameId) -> bool) {
        self.shared.state().queue.cancel(stale);
    }
}

impl<R: Renderer> Drop for RenderPool<R> {
    /// Cancels all jobs. The threads end at the next tile, and nothing waits for them.
    fn drop(&mut self) {
        let mut state = self.shared.state();
        state.stopping = true;
        state.queue.cancel(|_| true);
        self.shared.work.notify_all();
    }
}

impl<R: Renderer> Shared<R> {
    fn state(&self) -> MutexGuard<'_, State<R>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs one render thread.
    fn run(&self) {
        let mut packer = Packer::new();
        while let Some(band) = self.next_band() {
            self.render(band, &mut packer);
        }
    }

    fn next_band(&self) -> Option<PoolBand<R>> {
        let shape = |ready: &ReadyFrame<R::Frame>| BandShape {
            rows: self.renderer.band_rows(&ready.frame).max(1),
            row_bytes: ready.format.row_bytes(ready.width),
        };
        let mut state = self.state();
        loop {
            if state.stopping {
                return None;
            }
            if let Some(band) = state.queue.take_band(shape, &self.buffers) {
                return Some(band);
            }
            state = self.work.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn render(&self, band: PoolBand<R>, packer: &mut Packer) {
        let Band { job, rows, mut bytes } = band;
        let begun = Instant::now();
        let cancelled = || {
            self.progress.note();
            job.is_cancelled()
        };
        let rendered =
            catch_panic(|| self.renderer.render(&job.frame.frame, rows.clone(), &mut bytes, &cancelled));
        self.progress.note();
        match rendered {
            Ok(Ok(counts)) => {
                let cost = BandCost { counts, trace: begun.elapsed(), ..BandCost::default() };
                self.finish(Band { job, rows, bytes }, cost, packer);
            }
            // The cancellation has removed the job from the queue.
            Ok(Err(Cancelled)) => {}
            Err(reason) => self.fail(&job, reason),
        }
    }

    /// Encodes a band while its pixels are in the CPU's cache, and adds it to its job.
    fn finish(&self, band: PoolBand<R>, mut cost: BandCost, packer: &mut Packer) {
        let Band { job, rows, bytes: mut raw } = band;
        let begun = Instant::now();
        let ReadyFrame { rgb565, format, ref gain, .. } = *job.frame;
        if rgb565 {
            let Some(bytes) = pixels::to_rgb565(&mut raw) else {
                return self.fail(&job, "a pixel has a colour outside RGB 5-6-5".to_owned());
            };
            raw.truncate(bytes);
        }
        let block = match format {
            _ if !job.reply.compress || !gain.is_worthwhile() => None,
            PixelFormat::Rgb8 => packer.block(&raw),
            PixelFormat::Linear | PixelFormat::Sums => {
                pixels::planes_block(packer, &raw, format.bytes_per_pixel())
            }
        };
        block.iter().for_each(|block| gain.add(raw.len(), block.len()));
        if rgb565 || block.is_some() {
            cost.encode = begun.elapsed();
        }
        let (plain, blocks) = match rgb565 {
            true => (Encoding::Rgb565, Encoding::Rgb565Lz4),
            false => (Encoding::Raw, format.blocks()),
        };
        if let Some(rendered) = job.finish_band(rows, BandPixels { raw, plain, block, blocks }, cost) {
            self.state().queue.remove(&job);
            if rendered.encoding == Encoding::Raw {
                self.buffers.track(&rendered.bytes);
            }
            send_pixels(&job, rendered);
        }
    }

    /// Removes a job and reports the failure of its frame.
    fn fail(&self, job: &Arc<PoolJob<R>>, reason: String) {
        self.state().queue.remove(job);
        if job.cancel() {
            // The channel is closed where the session has ended.
            let _ = job.reply.failures.send((job.lease.frame, reason));
        }
    }
}

fn send_pixels<F>(job: &Job<F, JobReply>, rendered: Rendered) {
    let Rendered { encoding, bytes, cost } = rendered;
    let header = PixelsHeader { lease: job.lease, encoding, cost };
    // Fails where the session has ended. The master has leased the rows to another worker then.
    let _ = job.reply.pixels.blocking_send(ToMaster::Pixels { header, bytes });
}
