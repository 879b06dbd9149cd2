//! The render threads: plain threads of the system, so that rendering never waits for the network or the other way round.

use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use rayfarm_protocol::pixels::{self, Packer};
use rayfarm_protocol::{Encoding, FrameId, PixelFormat, PixelsHeader, ToMaster};
use tokio::sync::mpsc;

use crate::buffers::Buffers;
use crate::guard::guarded;
use crate::job_queue::{Band, BandCost, BandShape, Job, JobQueue, Pixels, Rendered};
use crate::renderer::{Cancelled, Renderer};

/// Where a session wants the results of its leases.
#[derive(Clone, Debug)]
pub(crate) struct Answers {
    /// Finished segments. Bounded: threads wait for a slow network rather than fill the memory.
    pub(crate) pixels: mpsc::Sender<ToMaster>,
    /// Frames that a bug made fail, and the reason.
    pub(crate) failures: mpsc::UnboundedSender<(FrameId, String)>,
    /// Whether pixels are compressed where that makes them fewer bytes.
    pub(crate) compress: bool,
}

/// A frame as a lease refers to it.
#[derive(Debug)]
pub(crate) struct ReadyFrame<F> {
    pub(crate) frame: F,
    pub(crate) width: u32,
    /// Whether its pixels take two bytes each on the wire.
    pub(crate) narrow: bool,
}

pub(crate) type PoolJob<R> = Job<ReadyFrame<<R as Renderer>::Frame>, Answers>;

type PoolBand<R> = Band<ReadyFrame<<R as Renderer>::Frame>, Answers>;
type PoolQueue<R> = JobQueue<ReadyFrame<<R as Renderer>::Frame>, Answers>;

/// A fixed number of threads that live as long as the pool.
pub(crate) struct RenderPool<R: Renderer> {
    shared: Arc<Shared<R>>,
}

struct Shared<R: Renderer> {
    renderer: Arc<R>,
    state: Mutex<State<R>>,
    work: Condvar,
    buffers: Buffers,
}

struct State<R: Renderer> {
    queue: PoolQueue<R>,
    stopping: bool,
}

impl<R: Renderer> RenderPool<R> {
    /// Starts the threads.
    pub(crate) fn new(renderer: Arc<R>, threads: usize) -> io::Result<Self> {
        let state = Mutex::new(State { queue: JobQueue::new(), stopping: false });
        let shared = Arc::new(Shared { renderer, state, work: Condvar::new(), buffers: Buffers::default() });
        let pool = Self { shared };
        for index in 0..threads {
            let shared = Arc::clone(&pool.shared);
            std::thread::Builder::new().name(format!("render-{index}")).spawn(move || shared.run())?;
        }
        Ok(pool)
    }

    pub(crate) fn submit(&self, job: PoolJob<R>) {
        self.shared.state().queue.push(job);
        self.shared.work.notify_all();
    }

    /// Leases queued or running.
    pub(crate) fn len(&self) -> usize {
        self.shared.state().queue.len()
    }

    /// Drops what is queued, and stops at the next tile what is running, of every stale frame.
    pub(crate) fn cancel(&self, stale: impl Fn(FrameId) -> bool) {
        self.shared.state().queue.cancel(stale);
    }
}

impl<R: Renderer> Drop for RenderPool<R> {
    /// The threads end by themselves at the next tile; nothing waits for them.
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

    fn run(&self) {
        let mut packer = Packer::new();
        while let Some(band) = self.next_band() {
            self.render(band, &mut packer);
        }
    }

    fn next_band(&self) -> Option<PoolBand<R>> {
        let shape = |ready: &ReadyFrame<R::Frame>| BandShape {
            rows: self.renderer.band_rows(&ready.frame).max(1),
            row_bytes: PixelFormat::SEGMENT.row_bytes(ready.width),
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
        let rendered = guarded(|| {
            self.renderer.render(&job.frame.frame, rows.clone(), &mut bytes, &|| job.is_cancelled())
        });
        match rendered {
            Ok(Ok(counts)) => {
                let cost = BandCost { counts, trace: begun.elapsed(), ..BandCost::default() };
                self.finish(Band { job, rows, bytes }, cost, packer);
            }
            // Whoever cancelled it has taken it off the queue.
            Ok(Err(Cancelled)) => {}
            Err(reason) => self.fail(&job, reason),
        }
    }

    /// Encodes a band while its pixels are warm, and gives it back.
    fn finish(&self, band: PoolBand<R>, mut cost: BandCost, packer: &mut Packer) {
        let Band { job, rows, bytes: mut raw } = band;
        let begun = Instant::now();
        let narrow = job.frame.narrow;
        if narrow {
            let Some(bytes) = pixels::to_rgb565(&mut raw) else {
                return self.fail(&job, "a pixel has none of the reduced colours".to_owned());
            };
            raw.truncate(bytes);
        }
        let block = if job.answer.compress { packer.block(&raw) } else { None };
        if narrow || block.is_some() {
            cost.encode = begun.elapsed();
        }
        if let Some(rendered) = job.finish_band(rows, Pixels { raw, narrow, block }, cost) {
            self.state().queue.remove(&job);
            if rendered.encoding == Encoding::Raw {
                self.buffers.lend(&rendered.bytes);
            }
            send(&job, rendered);
        }
    }

    fn fail(&self, job: &Arc<PoolJob<R>>, reason: String) {
        self.state().queue.remove(job);
        if job.cancel() {
            // A session that has ended needs no reason.
            let _ = job.answer.failures.send((job.lease.frame, reason));
        }
    }
}

fn send<F>(job: &Job<F, Answers>, rendered: Rendered) {
    let Rendered { encoding, bytes, cost } = rendered;
    let header = PixelsHeader { lease: job.lease, encoding, cost };
    // It fails when the session has ended: then the master has given the lease to somebody else.
    let _ = job.answer.pixels.blocking_send(ToMaster::Pixels { header, bytes });
}
