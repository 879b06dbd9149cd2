//! The driver: passes events to the scheduler and performs its actions. Only the driver reads the clock.
//!
//! Sessions, the timer and requests call the driver on their own threads. It handles each event under one lock and never
//! waits there: messages to workers go into bounded queues, and a worker whose queue is full is disconnected. Pixels are
//! decoded and hashed outside of the lock.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfarm_protocol::limits::{MAX_PIXELS_BYTES, MAX_RECEIVING_BYTES};
use rayfarm_protocol::session::ReceiveRoom;
use rayfarm_protocol::transport::MasterSecurity;
use rayfarm_protocol::{FrameAnnounce, FrameId, codec};
use rayfarm_scheduler::{Event, Scheduler};
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::tile_rows;
use tokio::sync::{Notify, mpsc};
use tokio_util::sync::CancellationToken;

mod answers;
mod perform;
mod reply;
mod routing;
mod verification;
mod workers;

use crate::accounting::pace::Pace;
use crate::accounting::{Accounts, TimelineSink};
use crate::admission::Door;
use crate::assets::Assets;
use crate::assets::scene_table::SceneTable;
use crate::descriptors;
use crate::error::FarmError;
use crate::finished::FinishedFrame;
use crate::format::wire_format;
use crate::framebuffer::Framebuffers;
use crate::options::FarmOptions;
use crate::sessions::identity::Tickets;
use crate::sessions::{ByteCount, Session, Sessions};
use crate::verification::arbiter::Dispute;
use crate::verification::delivered::{Delivered, FrameSet};
use crate::verification::{OpenSegments, SegmentDigest};
use crate::view_request::ViewRequest;
use reply::Reply;

pub(crate) use answers::AnswerError;

/// Finished frames that wait to be fetched. Beyond that, the oldest is dropped.
const MAX_UNFETCHED: usize = 8;

/// The farm's state and its clock.
pub(crate) struct Driver {
    started: Instant,
    pub(crate) assets: Arc<SceneTable>,
    framebuffers: Arc<Framebuffers>,
    inner: Mutex<Inner>,
    /// Notified when the scheduler's next timeout is earlier than the armed one.
    rearm: Notify,
    /// Notified when there is a result to fetch.
    finished: Notify,
    /// Notified when no segment is left to verify.
    verified: Notify,
    /// Disputes for the arbiter; at most one for each open segment.
    arbiter_queue: mpsc::UnboundedSender<Dispute>,
    /// The key from which the workers' own keys are derived; without it, no assets are passed from worker to worker.
    secret: Option<[u8; 32]>,
    /// Whether workers connect through TLS, and what they must prove.
    pub(crate) security: MasterSecurity,
    /// The secret names of local workers.
    pub(crate) tickets: Tickets,
    /// Connections before their sessions.
    pub(crate) door: Door,
    /// Room for the pixels that sessions receive.
    pub(crate) receiving: ReceiveRoom,
    /// Most workers at a time.
    max_workers: usize,
}

struct Inner {
    scheduler: Scheduler,
    accounts: Accounts,
    timeline: Option<TimelineSink>,
    sessions: Sessions,
    open_segments: OpenSegments,
    /// The reply that is being handled.
    reply: Option<Reply>,
    /// Digests that are to be computed after the lock is released.
    uncomputed: Vec<SegmentDigest>,
    delivered: Delivered,
    /// The requested frames that wait or are in flight.
    requests: BTreeMap<FrameId, Request>,
    unfetched: VecDeque<Result<FinishedFrame, FarmError>>,
    last_frame: u64,
    last_worker: u64,
    run: Run,
    /// All traffic up to the last finished frame.
    counted: ByteCount,
    armed_for: Option<Duration>,
    /// Whether the farm is shutting down: no worker is admitted any more.
    is_ending: bool,
}

/// Sums over the run.
#[derive(Debug, Default)]
struct Run {
    /// Frames of the whole run, where known.
    frames: Option<u64>,
    done: u64,
    /// Time at which the first frame was requested.
    begun: Option<Duration>,
    pace: Pace,
}

/// A requested frame.
struct Request {
    request: ViewRequest,
    /// The view that workers render.
    view: FrameView,
    announce: FrameAnnounce,
    /// Time of the request, on the driver's clock.
    at: Duration,
}

impl Driver {
    /// A driver without sessions and frames. Disputes about pixels go to `arbiter_queue`.
    ///
    /// # Errors
    /// [`FarmError::Random`], when segments are to be verified and the system gives no random numbers.
    pub(crate) fn new(
        options: &FarmOptions,
        assets: Arc<SceneTable>,
        arbiter_queue: mpsc::UnboundedSender<Dispute>,
    ) -> Result<Self, FarmError> {
        let key = match options.verify_percent {
            // Segments of untrusted workers are sampled all the same.
            0 => random().unwrap_or_default(),
            _ => random().map_err(FarmError::Random)?,
        };
        let scheduler = Scheduler::new(options.policy, MAX_PIXELS_BYTES as u64)
            .with_pipeline(!options.sequential)
            .with_verification(options.verify_percent, key);
        let inner = Inner {
            scheduler,
            accounts: Accounts::default(),
            timeline: None,
            sessions: Sessions::default(),
            open_segments: OpenSegments::default(),
            reply: None,
            uncomputed: Vec::new(),
            delivered: Delivered::default(),
            requests: BTreeMap::new(),
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
            arbiter_queue,
            security: options.security.clone(),
            tickets: Tickets::new(secret.as_ref(), options.local_workers),
            secret,
            door: Door::default(),
            receiving: ReceiveRoom::new(MAX_RECEIVING_BYTES),
            max_workers: descriptors::max_workers(),
        })
    }

    /// Reports the scheduler's timeouts to it, until `stop`.
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

    /// Reports the timeout to the scheduler, if it is due.
    fn wake(&self) {
        let mut inner = self.lock();
        inner.armed_for = None;
        let now = self.started.elapsed();
        if inner.scheduler.poll_timeout().is_some_and(|at| at <= now) {
            let mut silent = inner.scheduler.silent(now);
            silent.retain(|&worker| inner.sessions.get(worker).is_some_and(Session::is_receiving));
            for worker in silent {
                self.drive(&mut inner, Event::Receiving { worker });
            }
            self.drive(&mut inner, Event::Woken);
        }
    }

    /// Handles an event.
    pub(crate) fn handle(&self, event: Event) {
        self.drive(&mut self.lock(), event);
    }

    /// Requests a frame. A view that cannot be rendered is reported by [`Self::next_finished`].
    pub(crate) fn request(&self, request: ViewRequest) -> FrameId {
        let view = request.rendered();
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
                let row_bytes = announce.format.row_bytes(width) as u64;
                let at = self.started.elapsed();
                inner.requests.insert(frame, Request { request, view, announce, at });
                self.drive(&mut inner, Event::FrameRequested { frame, width, height, row_bytes, tile_rows });
            }
            Err(error) => self.deliver(&mut inner, Err(error)),
        }
        frame
    }

    /// Drops all frames that were requested so far.
    pub(crate) fn drop_requests(&self) {
        let mut inner = self.lock();
        let next = FrameId(inner.last_frame + 1);
        self.drive(&mut inner, Event::RequestsDropped { next });
    }

    /// Replaces the scene for all frames that are requested from now on.
    pub(crate) fn replace_scene(&self, scene: Arc<Assets>) {
        let mut inner = self.lock();
        let of_requests = inner.requests.values().map(|request| request.announce.scene);
        let shown: BTreeSet<_> = of_requests.chain(inner.open_segments.scenes()).collect();
        self.assets.replace(scene, &shown);
        inner.sessions.retain_assets(|id| self.assets.has(id));
    }

    /// The announcement of a frame: serialised once, the same bytes for all workers.
    fn announcement(&self, frame: FrameId, view: &FrameView) -> Result<FrameAnnounce, FarmError> {
        view.validate().map_err(FarmError::View)?;
        let bytes = codec::encode(view).map_err(|error| FarmError::Assets(error.into()))?;
        let (FrameView { width, height, .. }, format) = (*view, wire_format(view.format));
        Ok(FrameAnnounce {
            frame,
            scene: self.assets.current(),
            width,
            height,
            format,
            view: Bytes::from(bytes),
        })
    }

    /// Waits for the next finished frame or error.
    pub(crate) async fn next_finished(&self) -> Result<FinishedFrame, FarmError> {
        loop {
            if let Some(result) = self.lock().unfetched.pop_front() {
                return result;
            }
            self.finished.notified().await;
        }
    }

    /// Waits until no segment is left to verify.
    pub(crate) async fn all_verified(&self) {
        while self.lock().scheduler.verification().open > 0 {
            self.verified.notified().await;
        }
    }

    /// Finished frames with rows of workers that have sent wrong pixels.
    pub(crate) fn wrong_frames(&self) -> FrameSet {
        self.lock().delivered.wrong().clone()
    }

    /// Delivers an error to the caller of [`Self::next_finished`].
    pub(crate) fn report(&self, error: FarmError) {
        self.deliver(&mut self.lock(), Err(error));
    }

    /// Records a timeline of everything from now on.
    pub(crate) fn record_timeline(&self, sink: TimelineSink) {
        let mut inner = self.lock();
        inner.accounts.keep_marks();
        inner.timeline = Some(sink);
    }

    /// Sets a function that is called at the start of each decoding of pixels.
    #[cfg(test)]
    pub(crate) fn on_decode(&self, hook: impl Fn() + Send + Sync + 'static) {
        self.framebuffers.on_decode(hook);
    }

    /// Handles an event and all events that follow from it.
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
        if let Some(timeline) = &inner.timeline {
            std::iter::from_fn(|| inner.accounts.poll_mark()).for_each(|mark| timeline.record(mark));
        }
        let timeout = inner.scheduler.poll_timeout();
        if timeout.is_some_and(|at| inner.armed_for.is_none_or(|armed| at < armed)) {
            inner.armed_for = timeout;
            self.rearm.notify_one();
        }
    }

    fn deliver(&self, inner: &mut Inner, result: Result<FinishedFrame, FarmError>) {
        inner.unfetched.push_back(result);
        if inner.unfetched.len() > MAX_UNFETCHED {
            inner.unfetched.pop_front();
            tracing::warn!("{MAX_UNFETCHED} finished frames wait to be fetched; the oldest is dropped");
        }
        self.finished.notify_one();
    }

    /// Locks the state. A poisoned lock is used as it is: a panic leaves a state that later events can be handled in.
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A random key from which keys for workers are derived.
fn secret() -> Option<[u8; 32]> {
    let warn = |error: &String| tracing::warn!("workers pass no assets on: {error}");
    random().inspect_err(warn).ok()
}

/// Random bytes from the operating system.
fn random() -> Result<[u8; 32], String> {
    let mut bytes = [0; 32];
    let filled = getrandom::fill(&mut bytes);
    filled.map(|()| bytes).map_err(|error| format!("the system gives no random numbers: {error}"))
}
