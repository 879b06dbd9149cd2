//! Figures of the view: rates, latency and accounts, as the displays read them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_farm::FinishedFrame;
use rayfarm_farm::accounting::Fading;
use rayfarm_tracer::scene::Setting;
use serde::Serialize;

use super::film::FilmProgress;
use super::frame_log::FrameLine;
use super::frame_rate::FrameRate;
use super::latency::Latency;

/// The picture is at rest when nothing has been requested for this long: between two frames of a moving camera there may
/// be a moment without a request.
const QUIET: Duration = Duration::from_millis(300);

/// A snapshot of the figures.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Statistics {
    /// Frames completed since the viewer was started.
    pub(crate) completed: u64,
    /// Frames per second, smoothed over about a second.
    pub(crate) fps: f64,
    /// Lowest and highest rate within the last second, by the times between frames; `None` before the third frame.
    pub(crate) fps_range: Option<(f64, f64)>,
    /// Mean time of a frame.
    pub(crate) frame_time: Duration,
    /// Median time from an input to its picture on the screen, where known.
    pub(crate) latency: Option<Duration>,
    /// Time without a completed frame although one was requested.
    pub(crate) since_last_frame: Duration,
    /// Whether no frame is requested: the picture is complete and nothing moves.
    pub(crate) resting: bool,
    /// Lines of the quality controller about the picture at rest; empty while the picture moves or without a controller.
    pub(crate) quality: Vec<String>,
    /// Progress of the newest picture, if it is rendered in passes.
    pub(crate) film: Option<FilmProgress>,
    /// Reason for which no frame can be rendered, where known.
    pub(crate) problem: Option<String>,
    /// Fault in the files of the scene, which is shown as it was before.
    pub(crate) scene_fault: Option<String>,
    /// Integrator, samples and knobs of the view, before the quality controller; `None` before the first snapshot.
    #[serde(skip)]
    pub(crate) setting: Option<Setting>,
    /// Recent use of the workers' time.
    #[serde(skip)]
    pub(crate) accounts: Arc<Fading>,
}

impl Statistics {
    /// Whether a display could show anything else than with `older`. Times go on at rest without being shown.
    pub(super) fn differs_from(&self, older: &Self) -> bool {
        let figures = |it: &Self| (it.completed, it.latency, it.resting, it.film);
        !self.resting
            || figures(self) != figures(older)
            || self.setting != older.setting
            || (&self.quality, &self.problem, &self.scene_fault)
                != (&older.quality, &older.problem, &older.scene_fault)
            || !Arc::ptr_eq(&self.accounts, &older.accounts)
    }
}

/// Rest of the view, as far as it is known.
#[derive(Debug)]
struct Quiet {
    since: Duration,
    /// Lines of the quality controller about the picture at rest.
    quality: Vec<String>,
}

/// Figures of the view as the viewer collects them. Times are since the start of the viewer.
#[derive(Debug)]
pub(super) struct ViewerState {
    started: Instant,
    rate: FrameRate,
    latency: Latency,
    accounts: Fading,
    /// Copy of the accounts for snapshots, and the number of frames in it.
    published_accounts: (u64, Arc<Fading>),
    completed: u64,
    /// Time at which a frame was completed, or frames were requested again after a rest.
    last_completed: Duration,
    quiet: Option<Quiet>,
    /// Length of the rest before the frame in flight.
    rest: Duration,
    film: Option<FilmProgress>,
    problem: Option<String>,
    scene_fault: Option<String>,
    setting: Option<Setting>,
}

impl ViewerState {
    /// The state before the first frame.
    pub(super) fn new() -> Self {
        Self {
            started: Instant::now(),
            rate: FrameRate::default(),
            latency: Latency::default(),
            accounts: Fading::default(),
            published_accounts: (0, Arc::default()),
            completed: 0,
            last_completed: Duration::ZERO,
            quiet: None,
            rest: Duration::ZERO,
            film: None,
            problem: None,
            scene_fault: None,
            setting: None,
        }
    }

    /// Frames completed.
    pub(super) fn completed(&self) -> u64 {
        self.completed
    }

    /// Records that a frame was presented.
    pub(super) fn presented(&mut self, latency: Duration) {
        self.latency.add(latency);
    }

    /// Sets the progress of the newest picture; `None` for one that is not rendered in passes.
    pub(super) fn set_film(&mut self, film: Option<FilmProgress>) {
        self.film = film;
    }

    /// Sets integrator, samples and knobs of the view.
    pub(super) fn set_setting(&mut self, setting: Setting) {
        self.setting = Some(setting);
    }

    /// Sets or clears the reason for which no frame can be rendered.
    pub(super) fn set_problem(&mut self, problem: Option<String>) {
        self.problem = problem;
    }

    /// Sets or clears the fault in the files of the scene.
    pub(super) fn set_scene_fault(&mut self, fault: Option<String>) {
        self.scene_fault = fault;
    }

    /// Records whether nothing is requested, with the lines of the quality controller about the picture at rest.
    /// Figures from before a rest do not continue after it.
    pub(super) fn set_resting(&mut self, rests: Option<Vec<String>>) {
        let now = self.started.elapsed();
        match (rests, self.quiet.take()) {
            (Some(quality), before) => {
                self.quiet = Some(Quiet { since: before.map_or(now, |quiet| quiet.since), quality });
            }
            (None, Some(quiet)) if now.saturating_sub(quiet.since) >= QUIET => {
                self.rate.rested();
                self.last_completed = now;
                self.rest = now.saturating_sub(quiet.since);
            }
            (None, _) => {}
        }
    }

    /// Records a finished frame. Returns its line for the frame log.
    pub(super) fn add(&mut self, frame: &FinishedFrame) -> FrameLine {
        let at = self.started.elapsed();
        self.rate.completed(at, frame.elapsed);
        match std::mem::take(&mut self.rest) {
            Duration::ZERO => self.accounts.add(at, &frame.account),
            rest => self.accounts.add(at, &frame.account.without_rest(rest)),
        }
        let line = FrameLine::of(frame, self.completed, at, frame.elapsed, self.rate.fps(at));
        self.completed += 1;
        self.last_completed = at;
        self.problem = None;
        line
    }

    /// Copies the accounts for snapshots, where frames have been completed since the last copy. Takes time in proportion to
    /// the number of workers, so it is not done for each frame.
    pub(super) fn refresh_accounts(&mut self) {
        if self.published_accounts.0 != self.completed {
            self.published_accounts = (self.completed, Arc::new(self.accounts.clone()));
        }
    }

    /// A snapshot of all figures.
    pub(super) fn snapshot(&self) -> Statistics {
        let now = self.started.elapsed();
        let rests = |quiet: &&Quiet| now.saturating_sub(quiet.since) >= QUIET;
        let quiet = self.quiet.as_ref().filter(rests);
        Statistics {
            completed: self.completed,
            fps: self.rate.fps(now),
            fps_range: self.rate.range(now),
            frame_time: self.rate.frame_time(),
            latency: self.latency.median(),
            since_last_frame: now.saturating_sub(self.last_completed),
            resting: quiet.is_some(),
            quality: quiet.map_or_else(Vec::new, |quiet| quiet.quality.clone()),
            film: self.film,
            problem: self.problem.clone(),
            scene_fault: self.scene_fault.clone(),
            setting: self.setting,
            accounts: self.published_accounts.1.clone(),
        }
    }
}
