//! Drives the scheduler: the one reader of the clock. Events go in, actions come out and are performed at once.
//!
//! Whoever has an event (a session, the timer, a request) brings it itself, under one lock and without waiting for
//! anything: messages to workers go into bounded queues, and a worker whose queue is full is let go.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfarm_protocol::limits::MAX_PIXELS_BYTES;
use rayfarm_protocol::{FrameAnnounce, FrameId, codec};
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::tile_rows;
use tokio::sync::{Notify, mpsc};
use tokio_util::sync::CancellationToken;

use crate::accounting::{Accounts, TraceSink};
use crate::assets::Assets;
use crate::delivered::{Delivered, FrameSet};
use crate::farm::{FarmError, FarmOptions, FinishedFrame};
use crate::framebuffer::Framebuffers;
use crate::identity::Tickets;
use crate::judge::Case;
use crate::pace::Pace;
use crate::roster::{ByteCount, Roster};
use crate::scheduler::{Event, Scheduler};
use crate::seals::Seals;

mod answers;
mod passing;
mod people;
mod perform;
mod verify;

pub(crate) use answers::AnswerError;

/// Finished frames that wait to be fetched. Beyond that, the oldest is thrown away.
const MAX_UNFETCHED: usize = 8;

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
    /// There is nothing more to verify.
    verified: Notify,
    /// Rows that the master is to trace itself; no more than there are open audits.
    court: mpsc::UnboundedSender<Case>,
    /// What the workers' keys are made of; without it, nothing is passed on.
    secret: Option<[u8; 32]>,
    /// What local workers introduce themselves with.
    pub(crate) tickets: Tickets,
}

struct Inner {
    scheduler: Scheduler,
    accounts: Accounts,
    trace: Option<TraceSink>,
    roster: Roster,
    seals: Seals,
    delivered: Delivered,
    /// What the frames that wait or are in flight show.
    views: BTreeMap<FrameId, Requested>,
    unfetched: VecDeque<Result<FinishedFrame, FarmError>>,
    last_frame: u64,
    last_worker: u64,
    run: Run,
    /// All traffic up to the frame before.
    counted: ByteCount,
    armed_for: Option<Duration>,
    /// Whether goodbye has been said to everybody.
    is_ending: bool,
}

/// Sums over the run.
#[derive(Debug, Default)]
struct Run {
    /// Frames of all of it, where that is known.
    frames: Option<u64>,
    done: u64,
    /// When the first frame was requested.
    begun: Option<Duration>,
    pace: Pace,
}

/// A frame that was asked for.
struct Requested {
    view: FrameView,
    announce: FrameAnnounce,
    /// On the driver's clock.
    at: Duration,
}

impl Driver {
    /// `court`: whoever traces rows for the master itself.
    ///
    /// # Errors
    /// Segments are to be verified, and the system gives no random numbers to draw them with.
    pub(crate) fn new(
        options: &FarmOptions,
        assets: Assets,
        court: mpsc::UnboundedSender<Case>,
    ) -> Result<Self, FarmError> {
        let lots = match options.verify_percent {
            0 => [0; 32],
            _ => random().map_err(FarmError::Random)?,
        };
        let scheduler = Scheduler::new(options.policy, MAX_PIXELS_BYTES as u64)
            .with_pipeline(!options.sequential)
            .with_verification(options.verify_percent, lots);
        let inner = Inner {
            scheduler,
            accounts: Accounts::default(),
            trace: None,
            roster: Roster::default(),
            seals: Seals::default(),
            delivered: Delivered::default(),
            views: BTreeMap::new(),
            unfetched: VecDeque::new(),
            last_frame: 0,
            last_worker: 0,
            run: Run::default(),
            counted: ByteCount::default(),
            armed_for: None,
            is_ending: false,
        };
        let secret = secret();
        Ok(Self {
            started: Instant::now(),
            assets,
            framebuffers: Arc::default(),
            inner: Mutex::new(inner),
            rearm: Notify::new(),
            finished: Notify::new(),
            verified: Notify::new(),
            court,
            tickets: Tickets::new(secret.as_ref(), options.local_workers),
            secret,
        })
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
        if inner.run.begun.is_none() {
            let now = self.started.elapsed();
            inner.run.begun = Some(now);
            inner.run.pace.note(now, 0.0);
        }
        match self.announcement(frame, &view) {
            Ok(announce) => {
                let (FrameView { width, height, .. }, tile_rows) = (view, tile_rows(&view));
                inner.views.insert(frame, Requested { view, announce, at: self.started.elapsed() });
                self.drive(&mut inner, Event::FrameRequested { frame, width, height, tile_rows });
            }
            Err(error) => self.hand_out(&mut inner, Err(error)),
        }
        frame
    }

    /// Nobody wants the frames that were asked for so far.
    pub(crate) fn give_up(&self) {
        let mut inner = self.lock();
        let next = FrameId(inner.last_frame + 1);
        self.drive(&mut inner, Event::RequestsDropped { next });
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

    /// Waits until nothing is left to verify.
    pub(crate) async fn all_verified(&self) {
        while self.lock().scheduler.verification().open > 0 {
            self.verified.notified().await;
        }
    }

    /// Finished frames with rows of workers that were found to send wrong pixels.
    pub(crate) fn wrong_frames(&self) -> FrameSet {
        self.lock().delivered.wrong().clone()
    }

    /// Reports something that callers must hear of.
    pub(crate) fn report(&self, error: FarmError) {
        self.hand_out(&mut self.lock(), Err(error));
    }

    /// Tells a timeline of everything from now on.
    pub(crate) fn trace_into(&self, sink: TraceSink) {
        let mut inner = self.lock();
        inner.accounts.keep_marks();
        inner.trace = Some(sink);
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
                self.perform(inner, action, &mut events);
            }
        }
        if inner.scheduler.verification().open == 0 {
            self.verified.notify_one();
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

/// Numbers that nobody can guess.
fn secret() -> Option<[u8; 32]> {
    let told = |error: &String| tracing::warn!("workers pass no assets on: {error}");
    random().inspect_err(told).ok()
}

/// Numbers that only this process knows.
fn random() -> Result<[u8; 32], String> {
    let mut numbers = [0; 32];
    let filled = getrandom::fill(&mut numbers);
    filled.map(|()| numbers).map_err(|error| format!("the system gives no random numbers: {error}"))
}
