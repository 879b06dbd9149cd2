//! The accounts of all workers, fed with what happens to the scheduler and what it decides.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Range;
use std::time::Duration;

use rayfarm_protocol::{FrameId, Lease};

use super::ledger::{Answer, Ledger, Stretch};
use super::parts::Parts;
use super::span::{Mark, Span, What, laid_out};
use crate::scheduler::{Action, Cost, Event, WorkerId};

/// Workers that may leave during one frame with an account of their own; beyond that, they share one.
const MAX_GONE: usize = 1024;

/// What the workers did with their time while a frame was made: see [`crate::accounting`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameAccount {
    /// Each worker that was there, in the order in which they came.
    pub workers: Vec<WorkerAccount>,
    /// Who rendered what, in the order of arrival. Where rows were rendered twice, the first ones are in the picture.
    pub segments: Vec<SegmentNote>,
}

impl FrameAccount {
    /// The account without the time before the frame in which nothing was requested: that time is no loss.
    pub(crate) fn without_rest(&self, rest: Duration) -> Self {
        let mut account = self.clone();
        for worker in &mut account.workers {
            let idle = rest.as_nanos().saturating_mul(u128::from(worker.threads));
            let idle = u64::try_from(idle).unwrap_or(u64::MAX);
            worker.parts.wait = worker.parts.wait.saturating_sub(idle);
        }
        account
    }
}

/// What one worker did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WorkerAccount {
    /// Number given by the master; never reused.
    pub id: u64,
    /// What it calls itself.
    pub name: String,
    /// Its render threads.
    pub threads: u32,
    /// Its time.
    pub parts: Parts,
    /// Segments that it answered.
    pub segments: u32,
    /// Their rows.
    pub rows: u64,
    /// Bytes of pixels, as they came over the wire.
    pub bytes: u64,
}

/// Rows that one worker rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SegmentNote {
    /// From the top.
    pub first_row: u32,
    /// How many.
    pub row_count: u32,
    /// The worker's number.
    pub worker: u64,
    /// Nanoseconds of tracing, summed over its threads.
    pub trace_ns: u64,
}

impl FrameAccount {
    /// All workers together.
    pub fn sum(&self) -> Parts {
        let mut sum = Parts::default();
        self.workers.iter().for_each(|worker| sum.add(&worker.parts));
        sum
    }
}

/// Keeps the accounts. Times are since any fixed moment and never go backwards.
#[derive(Debug, Default)]
pub(crate) struct Accounts {
    workers: BTreeMap<WorkerId, Member>,
    /// Those who left since the last frame.
    gone: Vec<WorkerAccount>,
    /// Frames in flight, with what is known of them.
    frames: BTreeMap<FrameId, Sketch>,
    /// Whether a frame has ever begun: nothing is lost before that.
    begun: bool,
    last_done: Duration,
    done: Option<FrameAccount>,
    /// What a timeline wants to know, where there is one.
    marks: Option<VecDeque<Mark>>,
}

#[derive(Debug)]
struct Member {
    ledger: Ledger,
    account: WorkerAccount,
    /// Size of the pixels that are about to be reported as done, and what it took to take them in.
    taken_in: (u64, Duration),
}

#[derive(Debug, Default)]
struct Sketch {
    begun_at: Duration,
    segments: Vec<SegmentNote>,
    /// Rows of leases in the picture; no row is noted twice.
    noted: BTreeSet<(u32, u32)>,
}

impl Accounts {
    /// From now on, [`Self::poll_mark`] tells of every stretch of time.
    pub(crate) fn keep_marks(&mut self) {
        let named = |(&worker, member): (&WorkerId, &Member)| {
            let WorkerAccount { name, threads, .. } = &member.account;
            Mark::Named { worker, name: name.clone(), threads: *threads }
        };
        self.marks = Some(self.workers.iter().map(named).collect());
    }

    /// The next thing that a timeline shows.
    pub(crate) fn poll_mark(&mut self) -> Option<Mark> {
        self.marks.as_mut()?.pop_front()
    }

    /// The account of the frame that was done last, once.
    pub(crate) fn take_done(&mut self) -> FrameAccount {
        self.done.take().unwrap_or_default()
    }

    /// What a worker calls itself.
    pub(crate) fn name(&mut self, worker: WorkerId, name: &str) {
        let Some(member) = self.workers.get_mut(&worker) else { return };
        name.clone_into(&mut member.account.name);
        if let Some(marks) = &mut self.marks {
            let threads = member.account.threads;
            marks.push_back(Mark::Named { worker, name: name.to_owned(), threads });
        }
    }

    /// A worker asks for an asset.
    pub(crate) fn asset_wanted(&mut self, now: Duration, worker: WorkerId) {
        self.advance(now, worker);
        if let Some(member) = self.workers.get_mut(&worker) {
            member.ledger.fetch();
        }
    }

    /// Pixels of a worker, `bytes` long on the wire, took the master `decode`; [`Event::SegmentDone`] follows.
    pub(crate) fn taken_in(&mut self, worker: WorkerId, bytes: usize, decode: Duration) {
        if let Some(member) = self.workers.get_mut(&worker) {
            member.taken_in = (bytes as u64, decode);
        }
    }

    /// Something happens to the scheduler.
    pub(crate) fn event(&mut self, now: Duration, event: &Event) {
        match *event {
            Event::WorkerJoined { worker, threads, .. } => {
                self.leave(now, worker);
                let account = WorkerAccount { id: worker.0, threads, ..WorkerAccount::default() };
                let ledger = Ledger::new(now, threads);
                self.workers.insert(worker, Member { ledger, account, taken_in: Default::default() });
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
                let stretch = self.workers.get_mut(&worker).and_then(|member| member.ledger.fail());
                self.mark_parts(now, worker, stretch);
            }
            Event::PauseRequested { worker } => self.pause(now, worker, true),
            Event::ResumeRequested { worker } => self.pause(now, worker, false),
            Event::FrameRequested { .. }
            | Event::RequestsDropped { .. }
            | Event::WorkerDrains { .. }
            | Event::DrainRequested { .. }
            | Event::Pong { .. }
            | Event::Heard { .. }
            | Event::SegmentArbitrated { .. }
            | Event::Woken => {}
        }
    }

    /// The scheduler decides something.
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
                if let Some(member) = self.workers.get_mut(&worker) {
                    member.ledger.grant(lease);
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
            self.workers.values_mut().for_each(|member| member.ledger.begin(now));
        }
        self.frames.insert(frame, Sketch { begun_at: now, ..Sketch::default() });
    }

    fn finish(&mut self, now: Duration, frame: FrameId, elapsed: Duration) {
        self.advance_all(now);
        let sketch = self.frames.remove(&frame).unwrap_or_default();
        if let Some(marks) = &mut self.marks {
            let from = sketch.begun_at.max(self.last_done);
            let what = What::Frame { frame, elapsed };
            marks.push_back(Mark::Span(Span { worker: None, from, to: now, what }));
        }
        self.last_done = now;
        let mut workers: Vec<WorkerAccount> =
            self.workers.values_mut().map(|member| member.closed()).collect();
        workers.append(&mut self.gone);
        workers.sort_by_key(|worker| worker.id);
        self.done = Some(FrameAccount { workers, segments: sketch.segments });
    }

    /// A lease is answered; `shown`: with rows for a picture.
    fn answer(&mut self, now: Duration, worker: WorkerId, lease: Lease, cost: Cost, shown: bool) {
        self.advance(now, worker);
        let Some(member) = self.workers.get_mut(&worker) else { return };
        let (bytes, decode) = std::mem::take(&mut member.taken_in);
        let Cost { trace_ns, wait_ns, encode_ns, span_ns, .. } = cost;
        let answer = Answer { trace_ns, wait_ns, encode_ns, span_ns, decode };
        let Some(stretch) = member.ledger.answer(&lease, answer) else { return };
        member.account.segments = member.account.segments.saturating_add(1);
        member.account.rows = member.account.rows.saturating_add(lease.row_count.into());
        member.account.bytes = member.account.bytes.saturating_add(bytes);
        if shown {
            self.note(worker, lease, trace_ns);
        }
        if let Some(marks) = &mut self.marks {
            let what = What::Segment { lease, bytes };
            marks.push_back(Mark::Span(Span { worker: Some(worker), from: stretch.from, to: now, what }));
        }
        self.mark_parts(now, worker, Some(stretch));
    }

    /// Remembers who rendered which rows of a frame in flight.
    fn note(&mut self, worker: WorkerId, lease: Lease, trace_ns: u64) {
        let Lease { frame, first_row, row_count, .. } = lease;
        let Some(sketch) = self.frames.get_mut(&frame) else { return };
        if sketch.noted.insert((first_row, row_count)) {
            sketch.segments.push(SegmentNote { first_row, row_count, worker: worker.0, trace_ns });
        }
    }

    /// Rows have left a picture: others will be noted in their place.
    fn forget_notes(&mut self, frame: FrameId, rows: Range<u32>) {
        let Some(sketch) = self.frames.get_mut(&frame) else { return };
        let stays = |first: u32, count: u32| first >= rows.end || first.saturating_add(count) <= rows.start;
        sketch.segments.retain(|note| stays(note.first_row, note.row_count));
        sketch.noted.retain(|&(first, count)| stays(first, count));
    }

    fn cancel(&mut self, now: Duration, worker: WorkerId, before: FrameId) {
        self.advance(now, worker);
        let Some(member) = self.workers.get_mut(&worker) else { return };
        if member.ledger.holds_before(before) {
            let stretch = member.ledger.revoke(|lease| lease.frame < before);
            self.mark_parts(now, worker, stretch);
        }
    }

    fn pause(&mut self, now: Duration, worker: WorkerId, paused: bool) {
        self.advance(now, worker);
        if let Some(member) = self.workers.get_mut(&worker) {
            member.ledger.pause(paused);
        }
    }

    fn leave(&mut self, now: Duration, worker: WorkerId) {
        self.advance(now, worker);
        let Some(mut member) = self.workers.remove(&worker) else { return };
        let stretch = member.ledger.fail();
        self.mark_parts_of(now, worker, member.ledger.threads, stretch);
        let account = member.closed();
        let full = self.gone.len() >= MAX_GONE;
        match self.gone.last_mut().filter(|_| full) {
            None => self.gone.push(account),
            Some(others) => others.add(&account),
        }
    }

    fn advance(&mut self, now: Duration, worker: WorkerId) {
        let in_flight = !self.frames.is_empty();
        let Some(member) = self.workers.get_mut(&worker) else { return };
        if !self.begun {
            return member.ledger.begin(now);
        }
        let stretch = member.ledger.advance(now, in_flight);
        self.mark_parts(now, worker, stretch);
    }

    fn advance_all(&mut self, now: Duration) {
        for worker in self.workers.keys().copied().collect::<Vec<_>>() {
            self.advance(now, worker);
        }
    }

    fn mark_parts(&mut self, now: Duration, worker: WorkerId, stretch: Option<Stretch>) {
        if let Some(threads) = self.workers.get(&worker).map(|member| member.ledger.threads) {
            self.mark_parts_of(now, worker, threads, stretch);
        }
    }

    fn mark_parts_of(&mut self, now: Duration, worker: WorkerId, threads: u64, stretch: Option<Stretch>) {
        let (Some(marks), Some(stretch)) = (&mut self.marks, stretch) else { return };
        marks.extend(laid_out(worker, now, threads, &stretch.parts).into_iter().map(Mark::Span));
    }

    #[cfg(test)]
    pub(super) fn unsettled(&self, worker: WorkerId) -> u64 {
        self.workers.get(&worker).map_or(0, |member| member.ledger.unsettled())
    }
}

impl Member {
    /// The account up to now; the next one begins.
    fn closed(&mut self) -> WorkerAccount {
        self.account.parts = self.ledger.close();
        let WorkerAccount { id, threads, .. } = self.account;
        let next = WorkerAccount { id, threads, name: self.account.name.clone(), ..WorkerAccount::default() };
        std::mem::replace(&mut self.account, next)
    }
}

impl WorkerAccount {
    /// Adds what a worker did at another time.
    pub(crate) fn add(&mut self, other: &Self) {
        self.parts.add(&other.parts);
        self.segments = self.segments.saturating_add(other.segments);
        self.rows = self.rows.saturating_add(other.rows);
        self.bytes = self.bytes.saturating_add(other.bytes);
    }
}
