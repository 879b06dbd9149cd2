//! A simulated worker: its queue of leases, its threads, its condition.

use std::collections::VecDeque;
use std::ops::Range;

use rayfarm_scheduler::{FrameId, Lease};

use super::clock::MasterMessage;
use super::link::{Lane, Order};

/// State of one worker's machine.
#[derive(Debug)]
pub(crate) struct Machine {
    /// Work per second of all threads together.
    pub(crate) speed: f64,
    pub(crate) latency: u64,
    pub(crate) threads: Vec<Option<Band>>,
    queue: VecDeque<Job>,
    pub(crate) condition: Condition,
    /// Messages that arrived while it was stopped.
    pub(crate) unread: Vec<MasterMessage>,
    /// Threads that finished while it was stopped.
    pub(crate) unfinished: Vec<usize>,
    /// Whether a thread has finished a band since the last pong.
    finished_band: bool,
    pub(crate) up: Lane,
    pub(crate) up_order: Order,
    pub(crate) down_order: Order,
}

/// Health of a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Condition {
    Healthy,
    /// Slower by this factor.
    Slow(f64),
    /// Stopped and later continued, as a suspended process or one in a cut-off part of the network.
    Stopped,
    /// It answers pings and never a lease.
    Stuck,
    /// Its threads have stopped within their leases. It answers pings, without progress.
    Hung,
    /// As `Hung`, but it reports progress in every pong.
    Endless,
    /// Gone without closing the connection, which is half open.
    Vanished,
}

impl Condition {
    /// Whether its threads do nothing.
    pub(crate) fn is_halted(self) -> bool {
        matches!(self, Self::Stopped | Self::Hung | Self::Endless | Self::Vanished)
    }

    /// Whether it never recovers by itself.
    pub(crate) fn is_final(self) -> bool {
        matches!(self, Self::Stuck | Self::Hung | Self::Endless)
    }
}

/// A lease in its queue.
#[derive(Debug)]
struct Job {
    lease: Lease,
    next_row: u32,
    rows_done: u32,
    traced: u64,
}

/// Rows that a thread traces.
#[derive(Clone, Debug)]
pub(crate) struct Band {
    pub(crate) lease: Lease,
    pub(crate) rows: Range<u32>,
    pub(crate) nanoseconds: u64,
    /// The speed at which they are traced.
    pub(crate) speed: f64,
    /// Whether the lease was cancelled meanwhile.
    pub(crate) stale: bool,
}

impl Machine {
    pub(crate) fn new(speed: f64, threads: u32, latency: u64) -> Self {
        Self {
            speed,
            latency,
            threads: vec![None; threads.max(1) as usize],
            queue: VecDeque::new(),
            condition: Condition::Healthy,
            unread: Vec::new(),
            unfinished: Vec::new(),
            finished_band: false,
            up: Lane::default(),
            up_order: Order::default(),
            down_order: Order::default(),
        }
    }

    /// Present work per second of one thread.
    pub(crate) fn thread_speed(&self) -> f64 {
        let full = self.speed / self.threads.len() as f64;
        if let Condition::Slow(times) = self.condition { full / times } else { full }
    }

    /// Whether its threads have made progress since the last pong. A band has many tiles, so a thread that traces a band
    /// makes progress.
    pub(crate) fn report_progress(&mut self) -> bool {
        let finished_band = std::mem::take(&mut self.finished_band);
        match self.condition {
            Condition::Stuck | Condition::Hung => false,
            Condition::Endless => true,
            Condition::Healthy | Condition::Slow(_) | Condition::Stopped | Condition::Vanished => {
                finished_band || self.threads.iter().flatten().any(|band| !band.stale)
            }
        }
    }

    pub(crate) fn lease(&mut self, lease: Lease) {
        self.queue.push_back(Job { lease, next_row: lease.first_row, rows_done: 0, traced: 0 });
    }

    /// Drops leases of frames before `before`; threads finish their bands.
    pub(crate) fn cancel(&mut self, before: FrameId) {
        self.queue.retain(|job| job.lease.frame >= before);
        for band in self.threads.iter_mut().flatten() {
            band.stale |= band.lease.frame < before;
        }
    }

    pub(crate) fn idle_thread(&self) -> Option<usize> {
        self.threads.iter().position(Option::is_none)
    }

    /// The next untraced rows of the earliest lease, up to a multiple of `tile_rows`.
    pub(crate) fn next_band(&mut self, tile_rows: u32) -> Option<(Lease, Range<u32>)> {
        let job =
            self.queue.iter_mut().find(|job| job.next_row < job.lease.first_row + job.lease.row_count)?;
        let end = job.lease.first_row + job.lease.row_count;
        let stop = (job.next_row + 1).next_multiple_of(tile_rows.max(1)).min(end);
        let rows = job.next_row..stop;
        job.next_row = stop;
        Some((job.lease, rows))
    }

    /// Finishes a band. Returns the lease and its tracing time in nanoseconds if this was its last band.
    pub(crate) fn finish(&mut self, band: &Band) -> Option<(Lease, u64)> {
        self.finished_band = true;
        let job = self.queue.iter_mut().find(|job| job.lease == band.lease)?;
        job.rows_done += band.rows.end - band.rows.start;
        job.traced += band.nanoseconds;
        let done = (job.lease, job.traced);
        if job.rows_done < job.lease.row_count {
            return None;
        }
        self.queue.retain(|job| job.lease != band.lease);
        Some(done)
    }
}
