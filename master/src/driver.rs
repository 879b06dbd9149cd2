//! Drives the scheduler: the one reader of the clock. Events go in, actions come out and are performed at once.
//!
//! Whoever has an event (a session, the timer, a request) brings it itself, under one lock and without waiting for
//! anything: messages to workers go into bounded queues, and a worker whose queue is full is let go.

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfarm_protocol::limits::MAX_PIXELS_BYTES;
use rayfarm_protocol::session::{Sender, Traffic};
use rayfarm_protocol::{FrameAnnounce, FrameId, Hello, Lease, ToWorker, codec};
use rayfarm_tracer::scene::FrameView;
use tokio::sync::Notify;
use tokio_util::sync::CancellationToken;

use crate::assets::Assets;
use crate::farm::{FarmError, FarmStatus, FinishedFrame, WorkerStatus};
use crate::framebuffer::{Framebuffers, Misfit, Written};
use crate::lease_book::{LeaseBook, Standing};
use crate::scheduler::{Action, Cost, Event, Scheduler, SegmentPolicy, WorkerId};

/// Finished frames that wait to be fetched. Beyond that, the oldest is thrown away.
const MAX_UNFETCHED: usize = 8;
/// How long a worker's last messages may take.
const FAREWELL: Duration = Duration::from_secs(1);

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
    sessions: BTreeMap<WorkerId, Session>,
    /// What the frames that wait or are in flight show.
    views: BTreeMap<FrameId, (FrameView, FrameAnnounce)>,
    unfetched: VecDeque<Result<FinishedFrame, FarmError>>,
    last_frame: u64,
    last_worker: u64,
    /// Traffic of sessions that have ended.
    ended: Bytecount,
    /// All traffic up to the frame before.
    counted: Bytecount,
    armed_for: Option<Duration>,
}

/// A connected worker.
struct Session {
    hello: Hello,
    address: SocketAddr,
    sender: Sender<ToWorker>,
    traffic: Arc<Traffic>,
    leases: LeaseBook,
    trouble: Option<String>,
}

/// Bytes that went over the wire.
#[derive(Clone, Copy, Debug, Default)]
struct Bytecount {
    sent: u64,
    received: u64,
    scene: u64,
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
    pub(crate) fn new(policy: SegmentPolicy, assets: Assets) -> Self {
        let inner = Inner {
            scheduler: Scheduler::new(policy, MAX_PIXELS_BYTES as u64),
            sessions: BTreeMap::new(),
            views: BTreeMap::new(),
            unfetched: VecDeque::new(),
            last_frame: 0,
            last_worker: 0,
            ended: Bytecount::default(),
            counted: Bytecount::default(),
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
                inner.views.insert(frame, (view, announce));
                let FrameView { width, height, .. } = view;
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
        self.lock().sessions.len()
    }

    /// Whether a session is still wanted.
    pub(crate) fn knows(&self, worker: WorkerId) -> bool {
        self.lock().sessions.contains_key(&worker)
    }

    /// A number for a new worker.
    pub(crate) fn next_worker(&self) -> WorkerId {
        let mut inner = self.lock();
        inner.last_worker += 1;
        WorkerId(inner.last_worker)
    }

    /// A session has begun.
    pub(crate) fn join(
        &self,
        worker: WorkerId,
        hello: Hello,
        address: SocketAddr,
        sender: Sender<ToWorker>,
        traffic: Arc<Traffic>,
    ) {
        let threads = hello.threads;
        let session =
            Session { hello, address, sender, traffic, leases: LeaseBook::default(), trouble: None };
        let mut inner = self.lock();
        inner.sessions.insert(worker, session);
        self.drive(&mut inner, Event::WorkerJoined { worker, threads });
    }

    /// A session has ended; its worker is told why, where it still listens.
    pub(crate) fn leave(&self, worker: WorkerId, reason: &str) {
        let mut inner = self.lock();
        inner.end_session(worker, reason, true);
        self.drive(&mut inner, Event::WorkerLeft { worker });
    }

    /// Pixels have arrived: checks them against what this very worker holds, and puts them into the picture. They
    /// are there before the scheduler hears of them.
    pub(crate) fn pixels(
        &self,
        worker: WorkerId,
        lease: Lease,
        cost: Cost,
        bytes: &[u8],
    ) -> Result<(), AnswerError> {
        let standing = match self.lock().sessions.get_mut(&worker) {
            Some(session) => session.leases.answer(&lease),
            None => Standing::Revoked,
        };
        match standing {
            Standing::Granted => match self.framebuffers.write(lease, bytes)? {
                Written::Kept => self.handle(Event::SegmentDone { worker, lease, cost }),
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
        if let Some(session) = inner.sessions.get_mut(&worker) {
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
            let session = inner.sessions.get(&record.worker)?;
            Some(WorkerStatus {
                id: record.worker.0,
                name: session.hello.name.clone(),
                address: session.address,
                threads: session.hello.threads,
                segments_done: record.segments_done,
                speed: record.speed,
                trouble: session.trouble.clone(),
            })
        });
        let progress = inner.scheduler.progress();
        FarmStatus {
            workers: workers.collect(),
            frame: progress.map(|progress| progress.frame),
            rows_done: progress.map_or(0, |progress| progress.rows_done),
            rows: progress.map_or(0, |progress| progress.rows),
        }
    }

    /// Says goodbye to everybody and waits until they have heard it, for [`FAREWELL`] at most.
    pub(crate) async fn part(&self, reason: &str) {
        let farewells: Vec<_> = {
            let mut inner = self.lock();
            let ids: Vec<WorkerId> = inner.sessions.keys().copied().collect();
            ids.into_iter()
                .filter_map(|worker| {
                    let farewell = inner.end_session(worker, reason, false);
                    self.drive(&mut inner, Event::WorkerLeft { worker });
                    farewell
                })
                .collect()
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
            inner.scheduler.handle(self.started.elapsed(), event);
            while let Some(action) = inner.scheduler.poll_action() {
                events.extend(self.perform(inner, action));
            }
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
                if let Some((view, _)) = inner.views.get(&frame) {
                    self.framebuffers.open(frame, view.width, view.height);
                }
            }
            Action::FrameDone { frame, cost, elapsed } => self.frame_done(inner, frame, cost, elapsed),
            Action::FrameDropped { frame } => {
                inner.views.remove(&frame);
                self.framebuffers.discard(frame);
            }
            Action::Announce { worker, frame } => {
                let announce = inner.views.get(&frame).map(|(_, announce)| announce.clone())?;
                return inner.send(worker, ToWorker::Frame(announce));
            }
            Action::Grant { worker, lease } => {
                inner.sessions.get_mut(&worker)?.leases.grant(lease);
                return inner.send(worker, ToWorker::Segment(lease));
            }
            Action::Cancel { worker, before } => {
                inner.sessions.get_mut(&worker)?.leases.cancel(before);
                return inner.send(worker, ToWorker::Cancel { before });
            }
            Action::Ping { worker, nonce } => return inner.send(worker, ToWorker::Ping { nonce }),
            Action::Dismiss { worker, reason } => {
                inner.log_dismissal(worker, &reason);
                inner.end_session(worker, &reason, true);
            }
        }
        None
    }

    fn frame_done(&self, inner: &mut Inner, frame: FrameId, cost: Cost, elapsed: Duration) {
        let picture = inner.views.remove(&frame).zip(self.framebuffers.finish(frame));
        let Some(((view, _), pixels)) = picture else {
            debug_assert!(false, "frame {frame} was done without all of its pixels");
            return;
        };
        let now = inner.bytecount();
        let before = std::mem::replace(&mut inner.counted, now);
        let finished = FinishedFrame {
            frame,
            view,
            pixels,
            counts: cost,
            elapsed,
            workers: inner.sessions.len() as u32,
            threads: inner.sessions.values().map(|session| session.hello.threads).sum(),
            sent_bytes: now.sent.saturating_sub(before.sent),
            received_bytes: now.received.saturating_sub(before.received),
            scene_bytes: now.scene.saturating_sub(before.scene),
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

impl Inner {
    /// Queues a message. A worker that lets its queue fill up does not read: it is as good as gone.
    fn send(&mut self, worker: WorkerId, message: ToWorker) -> Option<Event> {
        let session = self.sessions.get(&worker)?;
        let error = session.sender.try_send(message).err()?;
        self.log_dismissal(worker, &format!("cannot send to it: {error}"));
        self.end_session(worker, "you do not read what you are sent", true);
        Some(Event::WorkerLeft { worker })
    }

    fn log_dismissal(&self, worker: WorkerId, reason: &str) {
        if let Some(Session { hello, address, .. }) = self.sessions.get(&worker) {
            tracing::warn!("{worker} ({}, {address}) is dismissed: {reason}", hello.name);
        }
    }

    /// Forgets a session and sees it off in the background: a last word, if there is room for it, then the end.
    /// `again` lets the worker come back: it is this session that has failed, not the farm that ends.
    fn end_session(
        &mut self,
        worker: WorkerId,
        reason: &str,
        again: bool,
    ) -> Option<tokio::task::JoinHandle<()>> {
        let Session { sender, traffic, .. } = self.sessions.remove(&worker)?;
        self.ended.add(&traffic);
        let goodbye = ToWorker::Goodbye { reason: reason.to_owned(), again };
        Some(tokio::spawn(async move {
            let last_words = async {
                // A session that has ended already needs none.
                if sender.send(goodbye).await.is_ok() {
                    sender.closed().await;
                }
            };
            let _ = tokio::time::timeout(FAREWELL, last_words).await;
            sender.abort();
        }))
    }

    fn bytecount(&self) -> Bytecount {
        let mut sum = self.ended;
        self.sessions.values().for_each(|session| sum.add(&session.traffic));
        sum
    }
}

impl Bytecount {
    fn add(&mut self, traffic: &Traffic) {
        self.sent += traffic.sent_bytes();
        self.received += traffic.received_bytes();
        self.scene += traffic.scene_sent_bytes();
    }
}
