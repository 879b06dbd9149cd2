//! Progress of a `render` run: a bar where standard error is a terminal, a line of the log now and then where it is not.

use std::io::{self, IsTerminal};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rayfarm_farm::Entrance;
use rayfarm_farm::FarmStatus;
use rayfarm_farm::accounting::duration_text;

use super::eta::Eta;
use crate::log_bar::{show_below_log, show_nothing_below_log};
use crate::viewer::film::FilmProgress;

/// Interval of the lines without a terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);
/// Time without any worker before the first warning, where a local one needs a moment to start, and before each further one.
const STARTUP_TIME: Duration = Duration::from_secs(3);
const REMIND_EVERY: Duration = Duration::from_secs(30);

/// Progress of one run.
pub(crate) struct Progress {
    bar: ProgressBar,
    frames: u64,
    done: u64,
    fps: f64,
    left: Option<Duration>,
    eta: Eta,
    started: Instant,
    /// Progress of the picture, if it is rendered in passes.
    film: Option<FilmProgress>,
    entrance: Entrance,
    local_workers: u32,
    alone_since: Option<Instant>,
    next_reminder: Duration,
    last_line: Instant,
    quiet: bool,
}

impl Progress {
    /// Progress of a run of `frames` frames, rendered by workers that connect at `entrance`.
    pub(crate) fn new(frames: u64, entrance: Entrance, local_workers: u32) -> Self {
        let quiet = !tracing::enabled!(tracing::Level::INFO);
        let target = match io::stderr().is_terminal() && !quiet {
            true => ProgressDrawTarget::stderr(),
            false => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(Some(frames), target).with_style(style("frames"));
        show_below_log(&bar);
        let now = Instant::now();
        Self {
            bar,
            frames,
            done: 0,
            fps: 0.0,
            left: None,
            eta: Eta::default(),
            started: now,
            film: None,
            entrance,
            local_workers,
            alone_since: None,
            next_reminder: startup_time(local_workers),
            last_line: now,
            quiet,
        }
    }

    /// Records that `done` frames are complete, at a current rate of `fps` frames per second.
    pub(crate) fn completed(&mut self, done: u64, fps: f64) {
        (self.done, self.fps) = (done, fps);
        self.bar.set_position(done);
    }

    /// Records the progress of a picture that is rendered in passes: the bar shows its samples.
    pub(crate) fn set_film(&mut self, film: FilmProgress) {
        if self.film.replace(film).is_none() {
            self.bar.set_style(style("samples"));
        }
        self.bar.set_length(film.of.into());
        self.bar.set_position(film.samples.into());
    }

    /// Shows the state of the farm. To be called several times a second.
    pub(crate) fn update(&mut self, status: &FarmStatus) {
        let predicted = match &self.film {
            None => status.totals.left,
            Some(film) => film.left.filter(|_| !film.is_complete()),
        };
        self.left = self.eta.left(self.started.elapsed(), predicted);
        let left = self.left.map_or(String::new(), |left| format!("{} left, ", duration_text(left)));
        self.bar.set_message(format!("{left}{}", self.state(status)));
        self.remind_of_workers(status.workers.is_empty());
        if self.bar.is_hidden() && !self.quiet && self.last_line.elapsed() >= LINE_EVERY {
            self.last_line = Instant::now();
            tracing::info!("{}", self.line(status));
        }
    }

    /// Removes the bar and logs the summary of the run.
    pub(crate) fn finish(&mut self, summary: &str) {
        self.bar.finish_and_clear();
        show_nothing_below_log();
        tracing::info!("{summary}");
    }

    fn remind_of_workers(&mut self, alone: bool) {
        if !alone {
            self.alone_since = None;
            self.next_reminder = startup_time(self.local_workers);
            return;
        }
        let since = *self.alone_since.get_or_insert_with(Instant::now);
        if since.elapsed() >= self.next_reminder {
            self.next_reminder += REMIND_EVERY;
            let worker = if self.local_workers == 0 { "a worker" } else { "this machine's worker" };
            tracing::warn!("waiting for {worker}; {}", self.entrance.reachable().for_log());
        }
    }

    fn line(&self, status: &FarmStatus) -> String {
        let left = self.left.map_or(String::new(), |left| format!(", {} left", duration_text(left)));
        match &self.film {
            None => format!("{} of {} frames{left}; {}", self.done, self.frames, self.state(status)),
            Some(film) => format!("{}{left}; {}", film.text(), workers(status)),
        }
    }

    /// State of the farm, and of the picture if it is rendered in passes.
    fn state(&self, status: &FarmStatus) -> String {
        match self.film {
            None => message(status, self.fps),
            Some(film) => format!("{}, {}", film.text(), workers(status)),
        }
    }
}

fn startup_time(local_workers: u32) -> Duration {
    if local_workers == 0 { Duration::ZERO } else { STARTUP_TIME }
}

fn style(what: &str) -> ProgressStyle {
    ProgressStyle::with_template(&format!("{{wide_bar}} {{pos}}/{{len}} {what}, {{msg}}"))
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Connected workers, and assets on the way to them.
fn workers(status: &FarmStatus) -> String {
    let workers = match status.workers.len() {
        0 => "waiting for a worker".to_owned(),
        1 => "1 worker".to_owned(),
        n => format!("{n} workers"),
    };
    match status.transfers.to_text() {
        Some(transfers) => format!("{workers}, {transfers}"),
        None => workers,
    }
}

fn message(status: &FarmStatus, fps: f64) -> String {
    let workers = workers(status);
    if fps >= 1.0 {
        return format!("{fps:.1} FPS, {workers}");
    }
    let percent = 100.0 * f64::from(status.rows_done) / f64::from(status.rows.max(1));
    format!("{fps:.2} FPS, {workers}, frame {percent:.0} %")
}
