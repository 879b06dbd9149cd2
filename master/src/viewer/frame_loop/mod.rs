//! Keeps the farm busy with what the window wants to see, and holds the newest picture for it.
//!
//! While something moves, two frames are requested: the one being rendered and the one after it, so that workers which
//! have nothing left to do in the first begin the second. A moved camera replaces the second as long as it has not begun.
//! At rest the picture is requested once, and then nothing until something changes.

use std::fs::File;
use std::io::BufWriter;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use super::frame_rate::FrameRate;
use super::latency::Latency;
use super::requests::{Answered, Pace, Requests, WindowState};
use crate::accounting::Fading;
use crate::app::error::CommandError;
use crate::app::reports::{FpsLog, FrameLine};
use crate::farm::{Farm, FarmError, FarmStatus, FinishedFrame};
use crate::viewer::quality_controller::QualityController;

/// How often the window learns of workers that come and go.
const STATUS_EVERY: Duration = Duration::from_millis(100);
/// A picture is called at rest when nothing has been requested for this long: between two frames of a moving camera
/// there may be a moment without a request.
const QUIET: Duration = Duration::from_millis(300);

/// What is asked of the farm.
pub(crate) struct Orders {
    /// What the window wants to see; the newest counts.
    pub(crate) wanted: watch::Receiver<WindowState>,
    /// How frames are requested.
    pub(crate) pace: Pace,
    /// Where each frame is noted.
    pub(crate) log: Option<FpsLog<BufWriter<File>>>,
    /// What holds a rate, if one is to be held.
    pub(crate) controller: Option<QualityController>,
}

/// A picture for the window.
#[derive(Debug)]
pub(crate) struct Arrival {
    /// The picture and what it took.
    pub(crate) frame: FinishedFrame,
    /// When what it shows was first wanted.
    pub(crate) asked_at: Instant,
    /// What the quality controller says of it.
    pub(crate) quality: Vec<String>,
}

/// What the window may know at any moment.
#[derive(Debug)]
pub(crate) struct News {
    started: Instant,
    /// The newest picture that the window has not taken yet.
    latest: Option<Arrival>,
    status: FarmStatus,
    rate: FrameRate,
    latency: Latency,
    accounts: Fading,
    completed: u64,
    /// When a frame was completed, or frames were requested again after a rest.
    last_completed: Duration,
    /// Since when nothing has been requested, and what the quality controller says of the picture.
    quiet: Option<(Duration, Vec<String>)>,
    /// How long nothing was requested before the frame that is on the way.
    rest: Duration,
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
            quiet: None,
            rest: Duration::ZERO,
            trouble: None,
        })))
    }

    /// The newest picture, once.
    pub(crate) fn take_picture(&self) -> Option<Arrival> {
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

    /// How long no frame has been completed although one was requested.
    pub(crate) fn since_last_frame(&self) -> Duration {
        let news = self.lock();
        news.started.elapsed().saturating_sub(news.last_completed)
    }

    /// Whether the picture rests: nothing has been requested for a while. With a quality controller, what it says of the picture.
    pub(crate) fn resting(&self) -> Option<Vec<String>> {
        let news = self.lock();
        let (since, controller) = news.quiet.as_ref()?;
        (news.started.elapsed().saturating_sub(*since) >= QUIET).then(|| controller.clone())
    }

    /// Notes whether anything is requested. Figures of the time before a rest say nothing of the time after it.
    fn note_rest(&self, rests: Option<Vec<String>>) {
        let mut news = self.lock();
        let now = news.started.elapsed();
        match (rests, news.quiet.take()) {
            (Some(controller), before) => {
                news.quiet = Some((before.map_or(now, |(since, _)| since), controller))
            }
            (None, Some((since, _))) if now.saturating_sub(since) >= QUIET => {
                news.rate.rested();
                news.last_completed = now;
                news.rest = now.saturating_sub(since);
            }
            (None, _) => {}
        }
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
    fn completed_frame(&self, frame: FinishedFrame, answered: Answered) -> FrameLine {
        let mut news = self.lock();
        let at = news.started.elapsed();
        news.rate.completed(at, frame.elapsed);
        let rest = std::mem::take(&mut news.rest);
        match rest {
            Duration::ZERO => news.accounts.add(at, &frame.account),
            rest => news.accounts.add(at, &frame.account.without_rest(rest)),
        }
        let line = FrameLine::of(&frame, news.completed, at, frame.elapsed, news.rate.fps(at));
        news.completed += 1;
        news.last_completed = at;
        let Answered { asked_at, quality } = answered;
        news.latest = Some(Arrival { frame, asked_at, quality });
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
    let Orders { mut wanted, pace, mut log, controller } = orders;
    let limit = pace.limit;
    let mut requests = Requests::new(pace, controller);
    let mut look = tokio::time::interval(STATUS_EVERY);
    let mut window_is_there = true;
    requests.fill(farm, &wanted.borrow_and_update().clone());
    loop {
        desk.note_rest(requests.at_rest());
        tokio::select! {
            biased;
            () = stop.cancelled() => return Ok(()),
            frame = farm.finished() => {
                let Some(frame) = desk.frame_or_trouble(frame)? else { continue };
                let answered = requests.finished(frame.frame, frame.elapsed, &frame.account);
                let line = desk.completed_frame(frame, answered);
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
            () = until(requests.rests_at()) => requests.rest(farm, &wanted.borrow_and_update().clone()),
            _ = look.tick() => desk.lock().status = farm.status(),
        }
    }
}

/// Waits until then; for ever where there is no such moment.
async fn until(at: Option<Instant>) {
    match at {
        Some(at) => tokio::time::sleep_until(at.into()).await,
        None => std::future::pending().await,
    }
}

#[cfg(test)]
mod tests;
