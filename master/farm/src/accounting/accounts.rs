//! The accounts of all workers, kept from the scheduler's events and actions.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Range;
use std::time::Duration;

use rayfarm_protocol::{FrameId, Lease};
use rayfarm_scheduler::{Action, Cost, Event, WorkerId};

use super::ledger::{Answer, Ledger, Stretch};
use super::parts::Parts;
use super::span::{Mark, Span, What, laid_out};

/// Workers that disconnect during one frame and keep an account of their own; beyond that, they share one.
const MAX_DISCONNECTED: usize = 1024;

/// Thread time of the workers while a frame was made, by use; see [`crate::accounting`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameAccount {
    /// Each worker that was connected, in the order in which they connected.
    pub workers: Vec<WorkerAccount>,
    /// The worker of each run of rows, in the order of arrival. Of rows that were rendered twice, the first are in the
    /// picture.
    pub segments: Vec<SegmentNote>,
}

impl FrameAccount {
    /// The account without the time, `rest`, in which no frame was requested: that time is no loss.
    pub fn without_rest(&self, rest: Duration) -> Self {
        let mut account = self.clone();
        for worker in &mut account.workers {
            let idle = rest.as_nanos().saturating_mul(u128::from(worker.threads));
            let idle = u64::try_from(idle).unwrap_or(u64::MAX);
            worker.parts.wait = worker.parts.wait.saturating_sub(idle);
        }
        account
    }
}

/// The account of one worker.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WorkerAccount {
    /// Number assigned by the master; never reused.
    pub id: u64,
    /// Name of the worker.
    pub name: String,
    /// Number of render threads of the worker.
    pub threads: u32,
    /// Thread time of the worker, split into parts.
    pub parts: Parts,
    /// Number of segments that the worker delivered.
    pub segments: u32,
    /// Rows of these segments.
    pub rows: u64,
    /// Bytes of pixels on the wire.
    pub bytes: u64,
}

/// A run of rows that one worker rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SegmentNote {
    /// The first row, counted from the top.
    pub first_row: u32,
    /// Number of rows.
    pub row_count: u32,
    /// Number of the worker.
    pub worker: u64,
    /// Nanoseconds of tracing, summed over its threads.
    pub trace_ns: u64,
}

impl FrameAccount {
    /// The sum over all workers.
    pub fn sum(&self) -> Parts {
        let mut sum = Parts::default();
        self.workers.iter().for_each(|worker| sum.add(&worker.parts));
        sum
    }
}

/// The accounts of all workers. Times are durations since a fixed moment and never decrease.
#[derive(Debug, Default)]
pub(crate) struct Accounts {
    workers: BTreeMap<WorkerId, WorkerBooks>,
    /// Accounts of workers that have disconnected since the last frame.
    disconnected: Vec<WorkerAccount>,
    /// Frames in flight.
    frames: BTreeMap<FrameId, FrameBooks>,
    /// Whether any frame has started: time before that is not accounted.
    begun: bool,
    last_done: Duration,
    done: Option<FrameAccount>,
    /// Marks for the timeline, if one is recorded.
    marks: Option<VecDeque<Mark>>,
}

#[derive(Debug)]
struct WorkerBooks {
    ledger: Ledger,
    account: WorkerAccount,
    /// Bytes of the pixels whose [`Event::SegmentDone`] is next, and the time to decode them.
    received: (u64, Duration),
}

#[derive(Debug, Default)]
struct FrameBooks {
    begun_at: Duration,
    segments: Vec<SegmentNote>,
    /// First row and row count of each noted lease, so that none is noted twice.
    noted: BTreeSet<(u32, u32)>,
}

impl Accounts {
    /// Starts to keep marks for [`Self::poll_mark`].
    pub(crate) fn keep_marks(&mut self) {
        let named = |(&worker, books): (&WorkerId, &WorkerBooks)| {
            let WorkerAccount { name, threads, .. } = &books.account;
            Mark::Named { worker, name: name.clone(), threads: *threads }
        };
        self.marks = Some(self.workers.iter().map(named).collect());
    }

    /// The next mark for the timeline.
    pub(crate) fn poll_mark(&mut self) -> Option<Mark> {
        self.marks.as_mut()?.pop_front()
    }

    /// Takes the account of the frame that was finished last.
    pub(crate) fn take_done(&mut self) -> FrameAccount {
        self.done.take().unwrap_or_default()
    }

    /// Sets the name of a worker.
    pub(crate) fn name(&mut self, worker: WorkerId, name: &str) {
        let Some(books) = self.workers.get_mut(&worker) else { return };
        name.clone_into(&mut books.account.name);
        if let Some(marks) = &mut self.marks {
            let threads = books.account.threads;
            marks.push_back(Mark::Named { worker, name: name.to_owned(), threads });
        }
    }

    /// Notes that a worker requests an asset.
    pub(crate) fn asset_requested(&mut self, now: Duration, worker: WorkerId) {
        self.advance(now, worker);
        if let Some(books) = self.workers.get_mut(&worker) {
            books.ledger.fetch();
        }
    }

    /// Notes that pixels of a worker, `bytes` long on the wire, took the master `decode` to decode and copy. Their
    /// [`Event::SegmentDone`] must follow.
    pub(crate) fn received(&mut self, worker: WorkerId, bytes: usize, decode: Duration) {
        if let Some(books) = self.workers.get_mut(&worker) {
            books.received = (bytes as u64, decode);
        }
    }

    /// Notes an event that the scheduler handles.
    pub(crate) fn event(&mut self, now: Duration, event: &Event) {
        match *event {
            Event::WorkerJoined { worker, threads, .. } => {
                self.leave(now, worker);
                let account = WorkerAccount { id: worker.0, threads, ..WorkerAccount::default() };
                let ledger = Ledger::new(now, threads);
                self.workers.insert(worker, WorkerBooks { ledger, account, received: Default::default() });
            }
            Event::WorkerLeft { worker } => self.leave(now, worker),
            Event::SegmentDone { worker, lease, cost } => self.answer(now, worker, lease, cost, true),
            Event::SegmentVerified { worker, lease, cost, .. } => {
                self.answer(now, worker, lease, cost, false)
            }
            Event::RowsRejected { frame, first_row, row_count } => {
                self.forget_notes(frame, first_row..first_row.saturating_add(row_count));
            }
            Event::WorkerFailed { worker, .. } => {
                self.advance(now, worker);
                let stretch = self.workers.get_mut(&worker).and_then(|books| books.ledger.fail());
                self.mark_parts(now, worker, stretch);
            }
            Event::PauseRequested { worker } => self.pause(now, worker, true),
            Event::ResumeRequested { worker } => self.pause(now, worker, false),
            Event::FrameRequested { .. }
            | Event::RequestsDropped { .. }
            | Event::BanLifted { .. }
            | Event::WorkerDrains { .. }
            | Event::DrainRequested { .. }
            | Event::Pong { .. }
            | Event::Heard { .. }
            | Event::Receiving { .. }
            | Event::SegmentArbitrated { .. }
            | Event::Woken => {}
        }
    }

    /// Notes an action that the scheduler decides on.
    pub(crate) fn action(&mut self, now: Duration, action: &Action) {
        match *action {
            Action::BeginFrame { frame } => self.begin(now, frame),
            Action::FrameDone { frame, elapsed, .. } => self.finish(now, frame, elapsed),
            Action::FrameDropped { frame } | Action::FrameFailed { frame } => {
                self.advance_all(now);
                self.frames.remove(&frame);
            }
            Action::Grant { worker, lease } | Action::Verify { worker, lease } => {
                self.advance(now, worker);
                if let Some(books) = self.workers.get_mut(&worker) {
                    books.ledger.grant(lease);
                }
            }
            Action::Cancel { worker, before } => self.cancel(now, worker, before),
            Action::Disconnect { worker, .. } | Action::Ban { worker, .. } => self.leave(now, worker),
            Action::RecordDigest { .. } | Action::Arbitrate { .. } | Action::DropDigest { .. } => {}
            Action::Announce { .. } | Action::Ping { .. } | Action::Drain { .. } => {}
        }
    }

    fn begin(&mut self, now: Duration, frame: FrameId) {
        if std::mem::replace(&mut self.begun, true) {
            self.advance_all(now);
        } else {
            self.workers.values_mut().for_each(|books| books.ledger.begin(now));
        }
        self.frames.insert(frame, FrameBooks { begun_at: now, ..FrameBooks::default() });
    }

    fn finish(&mut self, now: Duration, frame: FrameId, elapsed: Duration) {
        self.advance_all(now);
        let books = self.frames.remove(&frame).unwrap_or_default();
        if let Some(marks) = &mut self.marks {
            let from = books.begun_at.max(self.last_done);
            let what = What::Frame { frame, elapsed };
            marks.push_back(Mark::Span(Span { worker: None, from, to: now, what }));
        }
        self.last_done = now;
        let mut workers: Vec<WorkerAccount> = self.workers.values_mut().map(|books| books.closed()).collect();
        workers.append(&mut self.disconnected);
        workers.sort_by_key(|worker| worker.id);
        self.done = Some(FrameAccount { workers, segments: books.segments });
    }

    /// Notes the reply to a lease; `shown`: its rows go into a picture.
    fn answer(&mut self, now: Duration, worker: WorkerId, lease: Lease, cost: Cost, shown: bool) {
        self.advance(now, worker);
        let Some(books) = self.workers.get_mut(&worker) else { return };
        let (bytes, decode) = std::mem::take(&mut books.received);
        let Cost { trace_ns, wait_ns, encode_ns, span_ns, .. } = cost;
        let answer = Answer { trace_ns, wait_ns, encode_ns, span_ns, decode };
        let Some(stretch) = books.ledger.answer(&lease, answer) else { return };
        books.account.segments = books.account.segments.saturating_add(1);
        books.account.rows = books.account.rows.saturating_add(lease.row_count.into());
        books.account.bytes = books.account.bytes.saturating_add(bytes);
        if shown {
            self.note(worker, lease, trace_ns);
        }
        if let Some(marks) = &mut self.marks {
            let what = What::Segment { lease, bytes };
            marks.push_back(Mark::Span(Span { worker: Some(worker), from: stretch.from, to: now, what }));
        }
        self.mark_parts(now, worker, Some(stretch));
    }

    /// Notes which worker rendered the rows of a lease of a frame in flight.
    fn note(&mut self, worker: WorkerId, lease: Lease, trace_ns: u64) {
        let Lease { frame, first_row, row_count, .. } = lease;
        let Some(books) = self.frames.get_mut(&frame) else { return };
        if books.noted.insert((first_row, row_count)) {
            books.segments.push(SegmentNote { first_row, row_count, worker: worker.0, trace_ns });
        }
    }

    /// Drops the notes of rows that are removed from a picture and will be rendered again.
    fn forget_notes(&mut self, frame: FrameId, rows: Range<u32>) {
        let Some(books) = self.frames.get_mut(&frame) else { return };
        let stays = |first: u32, count: u32| first >= rows.end || first.saturating_add(count) <= rows.start;
        books.segments.retain(|note| stays(note.first_row, note.row_count));
        books.noted.retain(|&(first, count)| stays(first, count));
    }

    fn cancel(&mut self, now: Duration, worker: WorkerId, before: FrameId) {
        self.advance(now, worker);
        let Some(books) = self.workers.get_mut(&worker) else { return };
        if books.ledger.holds_before(before) {
            let stretch = books.ledger.revoke(|lease| lease.frame < before);
            self.mark_parts(now, worker, stretch);
        }
    }

    fn pause(&mut self, now: Duration, worker: WorkerId, paused: bool) {
        self.advance(now, worker);
        if let Some(books) = self.workers.get_mut(&worker) {
            books.ledger.pause(paused);
        }
    }

    fn leave(&mut self, now: Duration, worker: WorkerId) {
        self.advance(now, worker);
        let Some(mut books) = self.workers.remove(&worker) else { return };
        let stretch = books.ledger.fail();
        self.mark_parts_of(now, worker, books.ledger.threads, stretch);
        let account = books.closed();
        let full = self.disconnected.len() >= MAX_DISCONNECTED;
        match self.disconnected.last_mut().filter(|_| full) {
            None => self.disconnected.push(account),
            Some(others) => others.add(&account),
        }
    }

    fn advance(&mut self, now: Duration, worker: WorkerId) {
        let in_flight = !self.frames.is_empty();
        let Some(books) = self.workers.get_mut(&worker) else { return };
        if !self.begun {
            return books.ledger.begin(now);
        }
        let stretch = books.ledger.advance(now, in_flight);
        self.mark_parts(now, worker, stretch);
    }

    fn advance_all(&mut self, now: Duration) {
        for worker in self.workers.keys().copied().collect::<Vec<_>>() {
            self.advance(now, worker);
        }
    }

    fn mark_parts(&mut self, now: Duration, worker: WorkerId, stretch: Option<Stretch>) {
        if let Some(threads) = self.workers.get(&worker).map(|books| books.ledger.threads) {
            self.mark_parts_of(now, worker, threads, stretch);
        }
    }

    fn mark_parts_of(&mut self, now: Duration, worker: WorkerId, threads: u64, stretch: Option<Stretch>) {
        let (Some(marks), Some(stretch)) = (&mut self.marks, stretch) else { return };
        marks.extend(laid_out(worker, now, threads, &stretch.parts).into_iter().map(Mark::Span));
    }

    #[cfg(test)]
    pub(super) fn unsettled(&self, worker: WorkerId) -> u64 {
        self.workers.get(&worker).map_or(0, |books| books.ledger.unsettled())
    }
}

impl WorkerBooks {
    /// Closes the account and opens the next one.
    fn closed(&mut self) -> WorkerAccount {
        self.account.parts = self.ledger.close();
        let WorkerAccount { id, threads, .. } = self.account;
        let next = WorkerAccount { id, threads, name: self.account.name.clone(), ..WorkerAccount::default() };
        std::mem::replace(&mut self.account, next)
    }
}

impl WorkerAccount {
    /// Adds another account of the same worker.
    pub(crate) fn add(&mut self, other: &Self) {
        self.parts.add(&other.parts);
        self.segments = self.segments.saturating_add(other.segments);
        self.rows = self.rows.saturating_add(other.rows);
        self.bytes = self.bytes.saturating_add(other.bytes);
    }
}
