//! Keeps the farm busy with what the window wants to see, and holds the newest picture for it.
//!
//! Always two frames are asked for: the one being rendered and the one after it, so that workers which have nothing
//! left to do in the first begin the second. A moved camera replaces the second as long as it has not begun.

use std::collections::VecDeque;
use std::fs::File;
use std::io::BufWriter;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use super::frame_rate::FrameRate;
use super::latency::Latency;
use crate::accounting::Fading;
use crate::error::CommandError;
use crate::farm::{Farm, FarmError, FarmStatus, FinishedFrame, FrameId};
use crate::orbit::Animation;
use crate::report::{FpsLog, FrameLine};
use crate::wanted::WantedPicture;

/// How often the window learns of workers that come and go.
const STATUS_EVERY: Duration = Duration::from_millis(100);
/// The frame being rendered and the one after it.
const OPEN_REQUESTS: usize = 2;

/// What is asked of the farm.
pub(crate) struct Orders {
    /// What the window wants to see; the newest counts.
    pub(crate) wanted: watch::Receiver<WantedPicture>,
    /// What moves by itself.
    pub(crate) animation: Animation,
    /// End after so many frames.
    pub(crate) limit: Option<u64>,
    /// Where each frame is noted.
    pub(crate) log: Option<FpsLog<BufWriter<File>>>,
}

/// What the window may know at any moment.
#[derive(Debug)]
pub(crate) struct News {
    started: Instant,
    /// The newest picture that the window has not taken yet, and when it was asked for.
    latest: Option<(FinishedFrame, Instant)>,
    status: FarmStatus,
    rate: FrameRate,
    latency: Latency,
    accounts: Fading,
    completed: u64,
    last_completed: Duration,
    trouble: Option<String>,
}

/// The window's end of [`News`].
#[derive(Clone, Debug)]
pub(crate) struct NewsDesk(Arc<Mutex<News>>);

impl NewsDesk {
    /// With no news yet.
    pub(crate) fn new() -> Self {
        Self(Arc::new(Mutex::new(News {
            started: Instant::now(),
            latest: None,
            status: FarmStatus::default(),
            rate: FrameRate::default(),
            latency: Latency::default(),
            accounts: Fading::default(),
            completed: 0,
            last_completed: Duration::ZERO,
            trouble: None,
        })))
    }

    /// The newest picture, once, and when it was asked for.
    pub(crate) fn take_picture(&self) -> Option<(FinishedFrame, Instant)> {
        self.lock().latest.take()
    }

    /// A picture is on the screen, so long after it was asked for.
    pub(crate) fn shown(&self, after: Duration) {
        self.lock().latency.shown(after);
    }

    /// From an input to its picture on the screen, if that is known.
    pub(crate) fn latency(&self) -> Option<Duration> {
        self.lock().latency.median()
    }

    /// Where the workers' time went lately.
    pub(crate) fn accounts(&self) -> Fading {
        self.lock().accounts.clone()
    }

    /// The farm as last seen.
    pub(crate) fn status(&self) -> FarmStatus {
        self.lock().status.clone()
    }

    /// Frames per second and the time of one, now.
    pub(crate) fn rate(&self) -> (f64, Duration) {
        let news = self.lock();
        (news.rate.fps(news.started.elapsed()), news.rate.frame_time())
    }

    /// Frames completed so far.
    pub(crate) fn completed(&self) -> u64 {
        self.lock().completed
    }

    /// How long no frame has been completed.
    pub(crate) fn since_last_frame(&self) -> Duration {
        let news = self.lock();
        news.started.elapsed().saturating_sub(news.last_completed)
    }

    /// What keeps frames from coming, if that is known.
    pub(crate) fn trouble(&self) -> Option<String> {
        self.lock().trouble.clone()
    }

    /// A farm without workers is no reason to close the window: it says so, and somebody may start one.
    fn frame_or_trouble(
        &self,
        frame: Result<FinishedFrame, FarmError>,
    ) -> Result<Option<FinishedFrame>, CommandError> {
        let (frame, trouble) = match frame {
            Ok(frame) => (Some(frame), None),
            Err(FarmError::NoWorkers { reason, .. }) => (None, Some(reason)),
            Err(error) => return Err(CommandError::failed(error)),
        };
        self.lock().trouble = trouble;
        Ok(frame)
    }

    /// Notes a finished frame and returns its line for the log.
    fn completed_frame(&self, frame: FinishedFrame, asked_at: Instant) -> FrameLine {
        let mut news = self.lock();
        let at = news.started.elapsed();
        news.rate.completed(at, frame.elapsed);
        news.accounts.add(at, &frame.account);
        let line = FrameLine::of(&frame, news.completed, at, frame.elapsed, news.rate.fps(at));
        news.completed += 1;
        news.last_completed = at;
        news.latest = Some((frame, asked_at));
        line
    }

    /// Nothing panics while it holds the lock, and news are whole after every statement: a poisoned lock is usable.
    fn lock(&self) -> MutexGuard<'_, News> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Drives the farm until `stop` is cancelled, the limit is reached or the farm fails; cancels `stop` and shuts the
/// farm down in every case.
///
/// # Errors
/// What the farm could not do, or a frame log that could not be written.
pub(crate) async fn run(
    mut farm: Farm,
    orders: Orders,
    desk: NewsDesk,
    stop: CancellationToken,
) -> Result<(), CommandError> {
    let result = drive(&mut farm, orders, &desk, &stop).await;
    stop.cancel();
    farm.shut_down().await;
    result
}

async fn drive(
    farm: &mut Farm,
    orders: Orders,
    desk: &NewsDesk,
    stop: &CancellationToken,
) -> Result<(), CommandError> {
    let Orders { mut wanted, animation, limit, mut log } = orders;
    let mut requests = Requests::new(animation, limit);
    let mut look = tokio::time::interval(STATUS_EVERY);
    let mut window_is_there = true;
    requests.fill(farm, &wanted.borrow_and_update().clone());
    loop {
        tokio::select! {
            biased;
            () = stop.cancelled() => return Ok(()),
            frame = farm.finished() => {
                let Some(frame) = desk.frame_or_trouble(frame)? else { continue };
                let asked_at = requests.finished(frame.frame);
                let line = desk.completed_frame(frame, asked_at);
                if let Some(log) = &mut log {
                    log.add(&line)?;
                }
                if limit == Some(desk.completed()) {
                    return Ok(());
                }
                requests.after_finish(farm, &wanted.borrow_and_update().clone());
            }
            changed = wanted.changed(), if window_is_there => {
                window_is_there = changed.is_ok();
                requests.replace(farm, &wanted.borrow_and_update().clone());
            }
            _ = look.tick() => desk.lock().status = farm.status(),
        }
    }
}

/// Which frames have been asked for and are not here yet.
struct Requests {
    animation: Animation,
    limit: Option<u64>,
    /// The number, within the animation, of the next frame to ask for.
    next: u64,
    open: VecDeque<Open>,
    /// In which a picture was wanted last.
    size: Option<(u32, u32)>,
    /// When the camera moved last, until a frame that shows it is finished.
    moved_at: Option<Instant>,
}

/// A frame that was asked for.
struct Open {
    frame: FrameId,
    /// When what it shows was first wanted.
    asked_at: Instant,
}

impl Requests {
    fn new(animation: Animation, limit: Option<u64>) -> Self {
        Self { animation, limit, next: 0, open: VecDeque::new(), size: None, moved_at: None }
    }

    /// Asks until two are open.
    fn fill(&mut self, farm: &Farm, base: &WantedPicture) {
        while self.open.len() < OPEN_REQUESTS && self.ask(farm, base) {}
    }

    /// Frames come in order: all up to `frame` are done, or were replaced and will never come. When this one was
    /// asked for.
    fn finished(&mut self, frame: FrameId) -> Instant {
        let asked_at =
            self.open.iter().find(|open| open.frame == frame).map_or_else(Instant::now, |open| open.asked_at);
        self.open.retain(|open| open.frame > frame);
        self.moved_at = self.moved_at.filter(|&moved_at| moved_at > asked_at);
        asked_at
    }

    /// The next one is due. Asking even when two seem open costs nothing: one of them was replaced, or this replaces
    /// a request that has not begun by one for a newer camera.
    fn after_finish(&mut self, farm: &Farm, base: &WantedPicture) {
        self.ask(farm, base);
        self.fill(farm, base);
    }

    /// The camera has moved: the last request shall show what it sees now.
    fn replace(&mut self, farm: &Farm, base: &WantedPicture) {
        self.moved_at = Some(Instant::now());
        self.next = self.next.saturating_sub(1);
        self.ask(farm, base);
        self.fill(farm, base);
    }

    fn ask(&mut self, farm: &Farm, base: &WantedPicture) -> bool {
        if self.limit.is_some_and(|limit| self.next >= limit) && !self.open.is_empty() {
            return false;
        }
        let size = (base.view.width, base.view.height);
        if self.size.replace(size).is_some_and(|before| before != size) {
            // The window has another size: what is on the way was for the one before. Another scale alone changes nothing about that.
            farm.give_up();
            self.open.clear();
        }
        let view = self.animation.view(&base.rendered(), self.next);
        // A request that is asked for again, because the one before was replaced, is as old as the camera it shows.
        let asked_at = self.moved_at.unwrap_or_else(Instant::now);
        self.open.push_back(Open { frame: farm.request(view), asked_at });
        self.next += 1;
        true
    }
}
