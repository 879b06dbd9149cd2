//! Drives the scheduler: the one reader of the clock. Events go in, actions come out and are performed at once.
//!
//! Whoever has an event (a session, the timer, a request) brings it itself, under one lock and without waiting for
//! anything: messages to workers go into bounded queues, and a worker whose queue is full is let go.

use std::collections::{BTreeMap, VecDeque};
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfarm_protocol::limits::MAX_PIXELS_BYTES;
use rayfarm_protocol::{FrameAnnounce, FrameId, Hello, Lease, PixelsHeader, ToWorker, codec};
use rayfarm_tracer::TILE_SIZE;
use rayfarm_tracer::scene::FrameView;
use tokio::sync::Notify;
use tokio_util::sync::CancellationToken;

use crate::accounting::{Accounts, TraceSink};
use crate::assets::Assets;
use crate::farm::{FarmError, FarmStatus, FinishedFrame, WorkerStatus};
use crate::framebuffer::{Framebuffers, Misfit, Written};
use crate::lease_book::Standing;
use crate::roster::{ByteCount, Roster, Session, Unreachable};
use crate::scheduler::{Action, Cost, Event, Return, Scheduler, SegmentPolicy, WorkerId};

/// Finished frames that wait to be fetched. Beyond that, the oldest is thrown away.
const MAX_UNFETCHED: usize = 8;
/// Workers that are let in.
const MAX_WORKERS: usize = 1024;

/// The farm's state and its clock.
pub(crate) struct Driver {
    started: Instant,
    pub(crate) assets: Assets,
    framebuffers: Arc<Framebuffers>,
    inner: Mutex<Inner>,
    /// The scheduler wants to be woken earlier than before.
    rearm: Notify,
    /// There is a finished frame, or a reason why there will be none.
    finished: Notify,
}

struct Inner {
    scheduler: Scheduler,
    accounts: Accounts,
    trace: Option<TraceSink>,
    roster: Roster,
    /// What the frames that wait or are in flight show.
    views: BTreeMap<FrameId, Requested>,
    unfetched: VecDeque<Result<FinishedFrame, FarmError>>,
    last_frame: u64,
    last_worker: u64,
    /// All traffic up to the frame before.
    counted: ByteCount,
    armed_for: Option<Duration>,
}

/// A frame that was asked for.
struct Requested {
    view: FrameView,
    announce: FrameAnnounce,
    /// On the driver's clock.
    at: Duration,
}

/// Why an answer ends its session.
#[derive(Debug, thiserror::Error)]
pub(crate) enum AnswerError {
    /// The worker answers what it was not asked.
    #[error("it sent pixels of {0}, which it does not hold")]
    NotHeld(Lease),
    /// The pixels do not fit.
    #[error("its pixels do not fit: {0}")]
    Misfit(#[from] Misfit),
}

impl Driver {
    /// `sequential`: one frame in flight at a time.
    pub(crate) fn new(policy: SegmentPolicy, sequential: bool, assets: Assets) -> Self {
        let inner = Inner {
            scheduler: Scheduler::new(policy, MAX_PIXELS_BYTES as u64, TILE_SIZE).with_pipeline(!sequential),
            accounts: Accounts::default(),
            trace: None,
            roster: Roster::default(),
            views: BTreeMap::new(),
            unfetched: VecDeque::new(),
            last_frame: 0,
            last_worker: 0,
            counted: ByteCount::default(),
            armed_for: None,
        };
        Self {
            started: Instant::now(),
            assets,
            framebuffers: Arc::default(),
            inner: Mutex::new(inner),
            rearm: Notify::new(),
            finished: Notify::new(),
        }
    }

    /// Wakes the scheduler when it wants to be woken, until `stop`.
    pub(crate) async fn keep_time(&self, stop: CancellationToken) {
        loop {
            let wait =
                self.lock().scheduler.poll_timeout().map(|at| at.saturating_sub(self.started.elapsed()));
            let sleep = async {
                match wait {
                    Some(wait) => tokio::time::sleep(wait).await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                () = stop.cancelled() => return,
                () = self.rearm.notified() => {}
                () = sleep => self.wake(),
            }
        }
    }

    /// Tells the scheduler the time, if it is the time it wanted.
    fn wake(&self) {
        let mut inner = self.lock();
        inner.armed_for = None;
        if inner.scheduler.poll_timeout().is_some_and(|at| at <= self.started.elapsed()) {
            self.drive(&mut inner, Event::Woken);
        }
    }

    /// Brings an event.
    pub(crate) fn handle(&self, event: Event) {
        self.drive(&mut self.lock(), event);
    }

    /// Asks for a frame. One that cannot be asked for is reported by [`Self::next_finished`].
    pub(crate) fn request(&self, view: FrameView) -> FrameId {
        let mut inner = self.lock();
        inner.last_frame += 1;
        let frame = FrameId(inner.last_frame);
        match self.announcement(frame, &view) {
            Ok(announce) => {
                let FrameView { width, height, .. } = view;
                inner.views.insert(frame, Requested { view, announce, at: self.started.elapsed() });
                self.drive(&mut inner, Event::FrameRequested { frame, width, height });
            }
            Err(error) => self.hand_out(&mut inner, Err(error)),
        }
        frame
    }

    /// A frame as the workers are told of it: serialised once, the same bytes for all.
    fn announcement(&self, frame: FrameId, view: &FrameView) -> Result<FrameAnnounce, FarmError> {
        view.validate().map_err(FarmError::View)?;
        let bytes = codec::encode(view).map_err(|error| FarmError::Assets(error.into()))?;
        let FrameView { width, height, .. } = *view;
        Ok(FrameAnnounce { frame, scene: self.assets.scene(), width, height, view: Bytes::from(bytes) })
    }

    /// Waits for the next finished frame, or the reason why there is none.
    pub(crate) async fn next_finished(&self) -> Result<FinishedFrame, FarmError> {
        loop {
            if let Some(frame) = self.lock().unfetched.pop_front() {
                return frame;
            }
            self.finished.notified().await;
        }
    }

    /// Reports something that callers must hear of.
    pub(crate) fn report(&self, error: FarmError) {
        self.hand_out(&mut self.lock(), Err(error));
    }

    /// How many workers are connected.
    pub(crate) fn worker_count(&self) -> usize {
        self.lock().roster.len()
    }

    /// Whether a session is still wanted.
    pub(crate) fn knows(&self, worker: WorkerId) -> bool {
        self.lock().roster.get(worker).is_some()
    }

    /// A number for a new worker.
    pub(crate) fn next_worker(&self) -> WorkerId {
        let mut inner = self.lock();
        inner.last_worker += 1;
        WorkerId(inner.last_worker)
    }

    /// A session has begun.
    pub(crate) fn join(&self, worker: WorkerId, session: Session) {
        let Hello { name, threads, .. } = session.hello.clone();
        let mut inner = self.lock();
        inner.roster.add(worker, session);
        self.drive(&mut inner, Event::WorkerJoined { worker, threads });
        inner.accounts.name(worker, &name);
    }

    /// A worker asks for an asset.
    pub(crate) fn asset_wanted(&self, worker: WorkerId) {
        self.lock().accounts.asset_wanted(self.started.elapsed(), worker);
    }

    /// Tells a timeline of everything from now on.
    pub(crate) fn trace_into(&self, sink: TraceSink) {
        let mut inner = self.lock();
        inner.accounts.keep_marks();
        inner.trace = Some(sink);
    }

    /// Brings what a user wants of a connected worker; `false` if it is not connected.
    pub(crate) fn command(&self, worker: WorkerId, event: Event) -> bool {
        let mut inner = self.lock();
        let known = inner.roster.get(worker).is_some();
        if known {
            self.drive(&mut inner, event);
        }
        known
    }

    /// Sends a worker away at once and keeps it out; `false` if it is not connected.
    pub(crate) fn kick(&self, worker: WorkerId, reason: &str) -> bool {
        let mut inner = self.lock();
        let known = inner.roster.get(worker).is_some();
        if known {
            inner.roster.log_dismissal(worker, reason);
            inner.roster.bar(worker);
            inner.roster.end(worker, reason, Return::Unwanted);
            self.drive(&mut inner, Event::WorkerLeft { worker });
        }
        known
    }

    /// Lets kicked workers of this name in again. Returns how many were kept out.
    pub(crate) fn allow(&self, name: &str) -> usize {
        self.lock().roster.allow(name)
    }

    /// Why a worker that shakes hands is not let in, if it is not.
    pub(crate) fn refusal(&self, hello: &Hello, address: IpAddr) -> Option<String> {
        let inner = self.lock();
        let count = inner.roster.len();
        if inner.roster.is_barred(&hello.name, address) {
            return Some(format!(
                "a worker called {} was kicked from this master; it is kept out until the master allows it or ends",
                hello.name
            ));
        }
        (count >= MAX_WORKERS).then(|| format!("this master has {count} workers already, the most it takes"))
    }

    /// A session has ended; its worker is told why, where it still listens.
    pub(crate) fn leave(&self, worker: WorkerId, reason: &str) {
        let mut inner = self.lock();
        inner.roster.end(worker, reason, Return::Welcome);
        self.drive(&mut inner, Event::WorkerLeft { worker });
    }

    /// Pixels have arrived: checks them against what this very worker holds, and puts them into the picture. They
    /// are there before the scheduler hears of them.
    pub(crate) fn pixels(
        &self,
        worker: WorkerId,
        header: PixelsHeader,
        bytes: &[u8],
    ) -> Result<(), AnswerError> {
        let PixelsHeader { lease, encoding, cost } = header;
        let standing = match self.lock().roster.get_mut(worker) {
            Some(session) => session.leases.answer(&lease),
            None => Standing::Revoked,
        };
        match standing {
            Standing::Granted => match self.framebuffers.write(lease, encoding, bytes)? {
                Written::Kept { decode } => {
                    let mut inner = self.lock();
                    inner.accounts.taken_in(worker, bytes.len(), decode);
                    self.drive(&mut inner, Event::SegmentDone { worker, lease, cost });
                }
                Written::Superseded => {}
            },
            Standing::Revoked => {}
            Standing::Unknown => return Err(AnswerError::NotHeld(lease)),
        }
        Ok(())
    }

    /// A worker cannot render a frame.
    pub(crate) fn failed(&self, worker: WorkerId, frame: FrameId, reason: String) {
        let mut inner = self.lock();
        if let Some(session) = inner.roster.get_mut(worker) {
            session.leases.fail(frame);
            tracing::warn!("{worker} ({}) cannot render frame {frame}: {reason}", session.hello.name);
            session.trouble = Some(reason);
        }
        self.drive(&mut inner, Event::WorkerFailed { worker, frame });
    }

    /// A look at everything, for overlays.
    pub(crate) fn status(&self) -> FarmStatus {
        let inner = self.lock();
        let workers = inner.scheduler.workers().filter_map(|record| {
            let session = inner.roster.get(record.worker)?;
            Some(WorkerStatus {
                id: record.worker.0,
                name: session.hello.name.clone(),
                address: session.address,
                threads: session.hello.threads,
                segments_done: record.segments_done,
                speed: record.speed,
                state: record.state,
                trouble: session.trouble.clone(),
            })
        });
        let progress = inner.scheduler.progress();
        FarmStatus {
            workers: workers.collect(),
            kicked: inner.roster.barred(),
            frame: progress.map(|progress| progress.frame),
            rows_done: progress.map_or(0, |progress| progress.rows_done),
            rows: progress.map_or(0, |progress| progress.rows),
        }
    }

    /// Says goodbye to everybody and waits, not for long, until they have heard it.
    pub(crate) async fn part(&self, reason: &str) {
        let farewells: Vec<_> = {
            let mut inner = self.lock();
            let farewells = inner.roster.ids().into_iter().map(|worker| {
                let farewell = inner.roster.end(worker, reason, Return::Unwanted);
                self.drive(&mut inner, Event::WorkerLeft { worker });
                farewell
            });
            farewells.flatten().collect()
        };
        for farewell in farewells {
            // It bounds itself, and cannot fail.
            let _ = farewell.await;
        }
    }

    /// One event, and all that follows from it.
    fn drive(&self, inner: &mut Inner, event: Event) {
        let mut events = VecDeque::from([event]);
        while let Some(event) = events.pop_front() {
            let now = self.started.elapsed();
            inner.accounts.event(now, &event);
            inner.scheduler.handle(now, event);
            while let Some(action) = inner.scheduler.poll_action() {
                inner.accounts.action(now, &action);
                events.extend(self.perform(inner, action));
            }
        }
        if let Some(trace) = &inner.trace {
            std::iter::from_fn(|| inner.accounts.poll_mark()).for_each(|mark| trace.tell(mark));
        }
        let wanted = inner.scheduler.poll_timeout();
        if wanted.is_some_and(|wanted| inner.armed_for.is_none_or(|armed| wanted < armed)) {
            inner.armed_for = wanted;
            self.rearm.notify_one();
        }
    }

    /// Performs an action; what comes of it at once, if anything.
    fn perform(&self, inner: &mut Inner, action: Action) -> Option<Event> {
        match action {
            Action::BeginFrame { frame } => {
                if let Some(Requested { view, .. }) = inner.views.get(&frame) {
                    self.framebuffers.open(frame, view.width, view.height);
                }
            }
            Action::FrameDone { frame, cost, elapsed } => self.frame_done(inner, frame, cost, elapsed),
            Action::FrameDropped { frame } => {
                inner.views.remove(&frame);
                self.framebuffers.discard(frame);
            }
            Action::FrameFailed { frame } => {
                inner.views.remove(&frame);
                self.framebuffers.discard(frame);
                let reasons = inner.roster.troubles();
                self.hand_out(inner, Err(FarmError::Refused { frame, reasons }));
            }
            Action::Announce { worker, frame } => {
                let announce = inner.views.get(&frame).map(|requested| requested.announce.clone())?;
                return send(inner, worker, ToWorker::Frame(announce));
            }
            Action::Grant { worker, lease } => {
                inner.roster.get_mut(worker)?.leases.grant(lease);
                return send(inner, worker, ToWorker::Segment(lease));
            }
            Action::Cancel { worker, before } => {
                inner.roster.get_mut(worker)?.leases.cancel(before);
                return send(inner, worker, ToWorker::Cancel { before });
            }
            Action::Ping { worker, nonce } => return send(inner, worker, ToWorker::Ping { nonce }),
            Action::Drain { worker } => return send(inner, worker, ToWorker::Drain),
            Action::Dismiss { worker, reason, again } => {
                inner.roster.log_dismissal(worker, &reason);
                inner.roster.end(worker, &reason, again);
            }
        }
        None
    }

    fn frame_done(&self, inner: &mut Inner, frame: FrameId, cost: Cost, elapsed: Duration) {
        let picture = inner.views.remove(&frame).zip(self.framebuffers.finish(frame));
        let Some((Requested { view, at, .. }, pixels)) = picture else {
            debug_assert!(false, "frame {frame} was done without all of its pixels");
            return;
        };
        let now = inner.roster.byte_count();
        let bytes = now.since(std::mem::replace(&mut inner.counted, now));
        let finished = FinishedFrame {
            frame,
            view,
            pixels,
            counts: cost,
            elapsed,
            latency: self.started.elapsed().saturating_sub(at),
            workers: u32::try_from(inner.roster.len()).unwrap_or(u32::MAX),
            threads: inner.roster.threads(),
            sent_bytes: bytes.sent,
            received_bytes: bytes.received,
            scene_bytes: bytes.scene,
            account: inner.accounts.take_done(),
        };
        self.hand_out(inner, Ok(finished));
    }

    fn hand_out(&self, inner: &mut Inner, result: Result<FinishedFrame, FarmError>) {
        inner.unfetched.push_back(result);
        if inner.unfetched.len() > MAX_UNFETCHED {
            inner.unfetched.pop_front();
            tracing::warn!("nobody fetches finished frames; the oldest of {MAX_UNFETCHED} is thrown away");
        }
        self.finished.notify_one();
    }

    /// No panic leaves the state half changed in a way that later events could not live with.
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Queues a message; what comes of it when it cannot be.
fn send(inner: &mut Inner, worker: WorkerId, message: ToWorker) -> Option<Event> {
    inner.roster.send(worker, message).err().map(|Unreachable| Event::WorkerLeft { worker })
}
