//! Pictures that are rendered in passes: until an error or a time is reached, with a film that is saved and continued.

use std::time::{Duration, Instant};

use rayfarm_farm::accounting::FrameAccount;
use rayfarm_farm::{Farm, FinishedFrame, FrameCounts, FrameId, ViewRequest};
use rayfarm_tracer::scene::FrameView;
use tokio_util::sync::CancellationToken;

use super::Run;
use super::film_file::{self, FilmFile, PictureId};
use super::repair::{VERIFICATION_TIMEOUT, next};
use crate::app::cli::RenderArgs;
use crate::app::commands::source::Source;
use crate::app::output::check_writable;
use crate::app::progress::Progress;
use crate::app::reports::FilmReport;
use crate::error::CommandError;
use crate::viewer::OPEN_REQUESTS;
use crate::viewer::film::{Film, FilmTarget, Pace, passes};

/// Interval at which the film is saved while it grows.
const SAVE_EVERY: Duration = Duration::from_secs(60);
/// Interval at which the progress display shows the state of the farm.
const STATUS_EVERY: Duration = Duration::from_millis(200);

/// Rules of a run that renders its pictures in passes.
#[derive(Debug)]
pub(super) struct PassRules {
    /// Time after which the picture ends.
    time: Option<Duration>,
    /// File of the film.
    file: Option<FilmFile>,
    /// Film of an earlier run.
    continued: Option<Film>,
}

impl PassRules {
    /// The rules of a command line for a run of `frames`; `None` for pictures whose workers render all samples at once.
    ///
    /// # Errors
    /// Options for another integrator, or of one picture for several; a film that cannot be read or written.
    pub(super) fn of(
        args: &RenderArgs,
        source: &Source,
        request: &ViewRequest,
        frames: u32,
    ) -> Result<Option<Self>, CommandError> {
        let refuse = |problem: String| Err(CommandError::WrongInput(problem));
        let options = &args.passes;
        let view = request.rendered();
        match options.given() {
            // Workers have all samples of their rows, and end those of each pixel by its own error.
            None => return Ok(None),
            Some(option) if !passes::has_passes(&view) => {
                return refuse(format!("{option} is for the path integrator: render with --integrator path"));
            }
            Some(option) if args.denoise => {
                return refuse(format!(
                    "{option} adds up passes, and --denoise needs all samples at once: leave one of them out"
                ));
            }
            Some(option) if frames != 1 => {
                return refuse(format!("{option} is for one picture: render with --frames 1"));
            }
            _ => {}
        }
        let path = options.checkpoint.as_ref().or(options.continued.as_ref());
        path.map(|path| check_writable(path)).transpose()?;
        let picture = match path {
            Some(_) => Some(PictureId::of(&source.scene, &view)?),
            None => None,
        };
        let load = |path, picture| film_file::load(path, picture, &view);
        let continued =
            options.continued.as_deref().zip(picture).map(|(path, id)| load(path, id)).transpose()?;
        if let Some(samples) = continued.as_ref().map(Film::samples).filter(|samples| *samples > view.samples)
        {
            return refuse(format!(
                "the film has {samples} samples already, and {} are requested: render with --samples {samples} or more",
                view.samples
            ));
        }
        let file = path.zip(picture).map(|(path, picture)| FilmFile { path: path.clone(), picture });
        Ok(Some(Self { time: options.time, file, continued }))
    }
}

/// A picture that is rendered in passes.
struct Picture {
    /// The request for it, with all samples.
    whole: ViewRequest,
    /// The rendered view of `whole`.
    view: FrameView,
    target: FilmTarget,
    film: Film,
    /// Samples of earlier runs.
    continued: u32,
    pace: Pace,
    error: Option<f64>,
    /// First sample of the next pass to request.
    next: u32,
    open: usize,
    passes: u32,
    /// Time at which it ends.
    deadline: Option<Instant>,
    saved_at: Instant,
    /// Samples in the file.
    saved: u32,
}

impl Picture {
    fn new(whole: ViewRequest, continued: Option<Film>, time: Option<Duration>) -> Self {
        let (view, now) = (whole.rendered(), Instant::now());
        let film = continued.unwrap_or_else(|| Film::new(&view));
        let (samples, error) = (film.samples(), film.error());
        let mut pace = Pace::default();
        pace.record(Duration::ZERO, samples);
        Self {
            target: FilmTarget::of(&whole.view),
            whole,
            view,
            film,
            continued: samples,
            pace,
            error,
            next: samples,
            open: 0,
            passes: 0,
            deadline: time.and_then(|time| now.checked_add(time)),
            saved_at: now,
            saved: 0,
        }
    }

    /// Whether the picture has its samples, its error, or its time with at least one sample.
    fn is_complete(&self) -> bool {
        let is_late = self.deadline.is_some_and(|deadline| deadline <= Instant::now());
        self.target.is_reached(self.film.samples(), self.error) || is_late && self.film.samples() > 0
    }

    /// Requests passes until [`OPEN_REQUESTS`] are in flight or none is left.
    fn request(&mut self, farm: &Farm) {
        while self.open < OPEN_REQUESTS
            && let Some(range) = passes::next(self.next, self.whole.view.samples)
        {
            self.next = range.end;
            self.open += 1;
            farm.request(ViewRequest { view: passes::pass(&self.whole.view, range), ..self.whole });
        }
    }

    /// Drops the passes in flight.
    fn drop_requests(&mut self, farm: &Farm) {
        if self.open > 0 {
            farm.drop_requests();
        }
        (self.open, self.next) = (0, self.film.samples());
    }

    /// Whether the film has pixels of a worker that sent wrong ones.
    fn is_wrong(&self, farm: &Farm) -> bool {
        let wrong = farm.wrong_frames();
        self.film.frames().iter().any(|frame| wrong.contains(*frame))
    }

    /// Starts again without a sample.
    fn restart(&mut self, farm: &Farm) {
        tracing::warn!("the picture starts again, because a worker sent wrong pixels");
        (self.film, self.error, self.continued) = (Film::new(&self.view), None, 0);
        (self.pace, self.saved) = (Pace::default(), 0);
        self.drop_requests(farm);
    }

    /// The picture as a frame whose workers rendered all samples at once, in the format of `whole`.
    fn finished(&self, elapsed: Duration) -> FinishedFrame {
        let samples = self.film.samples();
        let format = self.whole.view.format;
        FinishedFrame {
            frame: self.film.frames().last().copied().unwrap_or(FrameId(0)),
            request: ViewRequest { view: passes::whole(&self.whole.view, samples), ..self.whole },
            view: self.film.shown(format),
            pixels: self.film.develop(format).into(),
            counts: FrameCounts::default(),
            elapsed,
            latency: elapsed,
            workers: 0,
            threads: 0,
            sent_bytes: 0,
            received_bytes: 0,
            scene_bytes: 0,
            account: FrameAccount::default(),
        }
    }
}

impl Run {
    /// Renders the frames of the plan in passes, one after the other, and writes their files.
    ///
    /// # Errors
    /// A farm that cannot go on, a file that cannot be written, an interruption. The film so far is saved before.
    pub(super) async fn render_in_passes(
        &mut self,
        farm: &mut Farm,
        mut rules: PassRules,
        progress: &mut Progress,
        interrupted: &CancellationToken,
    ) -> Result<(), CommandError> {
        self.files.totals.begin();
        for number in self.files.plan.frames.clone() {
            let whole = self.request(number);
            let started = Instant::now();
            let mut picture = Picture::new(whole, rules.continued.take(), rules.time);
            let rendered = self.render_picture(farm, &mut picture, &rules, progress, interrupted).await;
            let saved = save(&mut picture, &rules).await;
            if let (Err(_), Err(problem)) = (&rendered, &saved) {
                tracing::error!("{problem}");
            }
            self.note(&picture, &rules);
            rendered.and(saved)?;
            self.files.totals.complete_picture();
            self.write(farm, number, &picture, started.elapsed()).await?;
        }
        Ok(())
    }

    /// Renders passes until the picture is complete.
    async fn render_picture(
        &mut self,
        farm: &mut Farm,
        picture: &mut Picture,
        rules: &PassRules,
        progress: &mut Progress,
        interrupted: &CancellationToken,
    ) -> Result<(), CommandError> {
        let started = Instant::now();
        let verifies = farm.status().verification.is_some();
        let mut tick = tokio::time::interval(STATUS_EVERY);
        loop {
            progress.set_film(picture.pace.progress(&picture.target, picture.error));
            if picture.is_wrong(farm) {
                picture.restart(farm);
            }
            if picture.is_complete() {
                picture.drop_requests(farm);
                if verifies {
                    tokio::select! {
                        () = interrupted.cancelled() => return Err(interruption()),
                        _ = tokio::time::timeout(VERIFICATION_TIMEOUT, farm.verified()) => {}
                    }
                }
                if !picture.is_wrong(farm) {
                    return Ok(());
                }
                continue;
            }
            picture.request(farm);
            let deadline = picture.deadline.filter(|_| picture.film.samples() > 0);
            tokio::select! {
                biased;
                () = interrupted.cancelled() => return Err(interruption()),
                frame = farm.finished() => {
                    let frame = frame.map_err(CommandError::failed)?;
                    self.files.totals.add_pass(&frame, picture.passes.into())?;
                    picture.film.add(&frame).map_err(CommandError::failed)?;
                    picture.open = picture.open.saturating_sub(1);
                    picture.passes = picture.passes.saturating_add(1);
                    picture.error = picture.film.error();
                    picture.pace.record(started.elapsed(), picture.film.samples());
                }
                () = until(deadline) => {}
                _ = tick.tick() => progress.update(&farm.status()),
            }
            if picture.saved_at.elapsed() >= SAVE_EVERY {
                save(picture, rules).await?;
            }
        }
    }

    /// Records a picture for the report, and what an interrupted run has rendered.
    fn note(&mut self, picture: &Picture, rules: &PassRules) {
        let Picture { passes, continued, error, film, target, .. } = picture;
        let samples = film.samples();
        self.files.totals.film =
            Some(FilmReport { passes: *passes, samples, continued: *continued, error: *error });
        let file = match &rules.file {
            Some(FilmFile { path, .. }) if picture.saved > 0 => {
                format!("; the same command with --continue {} goes on", path.display())
            }
            _ => String::new(),
        };
        self.samples_so_far = Some(format!("{samples} of {} samples are rendered{file}", target.samples));
    }

    /// Writes the file of a picture, with its auxiliary pictures.
    async fn write(
        &mut self,
        farm: &mut Farm,
        number: u64,
        picture: &Picture,
        elapsed: Duration,
    ) -> Result<(), CommandError> {
        let whole = picture.whole;
        let files = &mut self.files;
        // A frame that must be rendered again has all samples at once.
        files.request.view = passes::whole(&files.request.view, picture.film.samples());
        files.collect(number, picture.finished(elapsed), None)?;
        picture.film.frames().iter().for_each(|frame| files.delivered.add_auxiliary(number, *frame));
        for aov in files.aov.clone() {
            farm.request(whole.auxiliary(aov.shading()));
            let auxiliary = next(farm).await.map_err(CommandError::failed)?;
            files.collect(number, auxiliary, None)?;
        }
        files.writer.ready().await?;
        files.write_next();
        Ok(())
    }
}

/// Saves the film of a picture, if it has a file and has grown. The file is written on a blocking thread.
async fn save(picture: &mut Picture, rules: &PassRules) -> Result<(), CommandError> {
    picture.saved_at = Instant::now();
    let samples = picture.film.samples();
    let Some(file) = rules.file.clone().filter(|_| samples > 0 && samples != picture.saved) else {
        return Ok(());
    };
    let (film, view) = (picture.film.clone(), picture.view);
    let work = move || film_file::save(&file.path, file.picture, &view, &film);
    tokio::task::spawn_blocking(work).await.map_err(CommandError::failed)?.map_err(CommandError::Failed)?;
    picture.saved = samples;
    Ok(())
}

/// The error of a run that a signal ends; the report of its progress replaces its text.
fn interruption() -> CommandError {
    CommandError::Interrupted(String::new())
}

/// Waits until a time. Never returns where there is none.
async fn until(at: Option<Instant>) {
    match at {
        Some(at) => tokio::time::sleep_until(at.into()).await,
        None => std::future::pending().await,
    }
}
