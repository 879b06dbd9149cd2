//! `render`: frames to files, no display needed.

use std::collections::VecDeque;
use std::fs::File;
use std::io::BufWriter;
use std::time::{Duration, Instant};

use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::scene::{FrameView, RenderScale};
use tokio_util::sync::CancellationToken;

use repair::{Taken, named};

use super::interrupt::cancelled_by_signals;
use super::ladder::within;
use super::observability::Observability;
use super::source::{Source, animation};
use crate::accounting::RunAccount;
use crate::app::cli::RenderArgs;
use crate::app::error::CommandError;
use crate::app::output::{FrameWriter, OutputPattern, check_writable};
use crate::app::plan::{Existing, Plan};
use crate::app::progress::Progress;
use crate::app::reports::{
    BytesPerFrame, FpsLog, FrameLine, MsPerFrame, RaysPerFrame, RenderReport, VerificationReport, mean,
    print_json,
};
use crate::display::overlay::three_digits;
use crate::farm::{Farm, FarmOptions, FarmScene, FinishedFrame};
use crate::viewer::frame_rate::FrameRate;
use crate::viewer::orbit::Animation;
use crate::viewer::view_request::ViewRequest;

mod repair;
#[cfg(test)]
mod tests;

/// The frame being rendered and the one after it, so that workers never run dry between two frames.
const OPEN_REQUESTS: u64 = 2;
/// With so many pictures waiting for the disk, no more are asked for.
const MAX_UNWRITTEN: usize = 2;
/// How often the progress display looks at the farm.
const LOOK_EVERY: Duration = Duration::from_millis(200);
/// How long local workers may take to come before the run begins without them, and how often that is looked at.
const MUSTER: Duration = Duration::from_secs(5);
const MUSTER_LOOK: Duration = Duration::from_millis(2);

/// Renders all frames and writes them.
///
/// # Errors
/// A wrong scene or output, found before anything is rendered; a farm that cannot listen or go on; a full disk; an
/// interruption.
pub(super) fn run(args: RenderArgs) -> Result<(), CommandError> {
    let pattern = OutputPattern::parse(&args.output, args.frames)?;
    pattern.path(args.first_frame.into()).as_deref().map(check_writable).transpose()?;
    let source = Source::load(&args.scene, args.models, args.picture.size)?;
    let wanted = within(&args.error, &source, source.wanted(&args.picture)?)?;
    let plan = plan(&args, &pattern, &wanted)?;
    let triangles = source.compiled()?.triangle_count();
    let log = args.fps_log.as_deref().map(FpsLog::create).transpose()?;
    let observability = Observability::new(&args.observability)?;
    let run = Run {
        wanted,
        animation: animation(&args.picture, args.frames),
        plan,
        requested: 0,
        wait_for_workers: args.wait_for_workers,
        unwritten: VecDeque::new(),
        taken: Taken::default(),
        writer: FrameWriter::new(pattern),
        totals: Totals::new(triangles, log),
        observability,
    };
    let scene = FarmScene { scene: source.scene, meshes: source.meshes, textures: source.textures };
    let report = match run.plan.frames.is_empty() {
        true => run.nothing_to_do()?,
        false => super::runtime()?.block_on(run.carry_out(args.farm.options(), scene))?,
    };
    if args.json {
        print_json(&report)?;
    }
    match report.verification.map(|verification| verification.wrong_frames).unwrap_or_default().as_slice() {
        [] => Ok(()),
        wrong => Err(CommandError::Failed(format!(
            "frames {} have rows of workers that sent wrong pixels, and could not be rendered again: render them with \
             other workers",
            named(wrong)
        ))),
    }
}

/// Which frames are rendered.
fn plan(args: &RenderArgs, pattern: &OutputPattern, wanted: &ViewRequest) -> Result<Plan, CommandError> {
    let FrameView { width, height, .. } = wanted.view;
    let existing = match (args.resume, args.skip_existing) {
        (true, _) => Existing::Resume { width, height },
        (_, true) => Existing::Skip,
        _ => Existing::Replace,
    };
    Plan::new(args.first_frame.into(), args.frames.into(), existing, pattern)
}

/// One run of `render`.
struct Run {
    wanted: ViewRequest,
    animation: Animation,
    plan: Plan,
    /// Frames of the plan that were requested.
    requested: u64,
    /// So many must be there before the run begins, however long that takes.
    wait_for_workers: Option<u32>,
    /// Pictures that the writer has no room for yet.
    unwritten: VecDeque<(u64, FinishedFrame)>,
    taken: Taken,
    writer: FrameWriter,
    totals: Totals,
    observability: Observability,
}

impl Run {
    /// Starts a farm, renders everything with it, and ends it whatever happened.
    async fn carry_out(
        mut self,
        options: FarmOptions,
        scene: FarmScene,
    ) -> Result<RenderReport, CommandError> {
        let interrupted = cancelled_by_signals();
        let local_workers = options.local_workers;
        let mut farm = Farm::start(options, scene).await.map_err(CommandError::failed)?;
        if let Err(error) = self.observability.begin(&farm, &interrupted) {
            farm.shut_down().await;
            return Err(error);
        }
        farm.expect_frames(self.frames());
        let mut progress = Progress::new(self.frames(), farm.address(), local_workers);
        self.muster(&farm, local_workers, &mut progress, &interrupted).await;
        self.totals.begin();
        let rendered = self.render(&mut farm, &mut progress, &interrupted).await;
        let written = self.writer.finish().await;
        progress.finish(&self.totals.summary(self.writer.written(), &self.plan, self.writer.has_files()));
        let verifies = farm.status().verification.is_some();
        if verifies && rendered.is_ok() && written.is_ok() {
            self.repair(&mut farm, &interrupted).await;
        }
        self.totals.verification = self.verification(&farm);
        farm.shut_down().await;
        let traced = self.observability.end();
        match rendered.and(written).and(traced) {
            Err(CommandError::Interrupted(_)) => Err(CommandError::Interrupted(self.so_far())),
            result => result.map(|()| self.totals.report(&self.wanted, &self.plan)),
        }
    }

    /// Frames to render.
    fn frames(&self) -> u64 {
        self.plan.frames.len() as u64
    }

    /// How far an interrupted run came.
    fn so_far(&self) -> String {
        let frames = self.frames();
        if !self.writer.has_files() {
            return format!("{} of {frames} frames are rendered", self.totals.times.len());
        }
        let written = self.writer.written();
        let on = if frames > 1 { "; the same command with --resume goes on" } else { "" };
        format!("{written} of {frames} frames are written{}{on}", self.plan.already())
    }

    /// Every file is there already.
    fn nothing_to_do(mut self) -> Result<RenderReport, CommandError> {
        tracing::info!("all {} frames are there already: nothing to render", self.plan.skipped);
        self.observability.end()?;
        Ok(self.totals.report(&self.wanted, &self.plan))
    }

    /// Waits until the workers are there, so that figures are of the number of workers that was asked for and do not
    /// tell how fast processes start. A local one that does not come is not waited for long.
    async fn muster(
        &self,
        farm: &Farm,
        local_workers: u32,
        progress: &mut Progress,
        interrupted: &CancellationToken,
    ) {
        let (count, patience) =
            self.wait_for_workers.map_or((local_workers, MUSTER), |count| (count, Duration::MAX));
        let all_there = async {
            let mut status = farm.status();
            while status.workers.len() < count as usize {
                progress.look(&status);
                tokio::time::sleep(MUSTER_LOOK).await;
                status = farm.status();
            }
        };
        tokio::select! {
            () = interrupted.cancelled() => {}
            _ = tokio::time::timeout(patience, all_there) => {}
        }
    }

    async fn render(
        &mut self,
        farm: &mut Farm,
        progress: &mut Progress,
        interrupted: &CancellationToken,
    ) -> Result<(), CommandError> {
        let mut look = tokio::time::interval(LOOK_EVERY);
        let mut arrived = 0;
        while arrived < self.frames() || !self.unwritten.is_empty() {
            if self.unwritten.len() < MAX_UNWRITTEN {
                self.request_up_to(arrived + OPEN_REQUESTS, farm);
            }
            tokio::select! {
                biased;
                () = interrupted.cancelled() => return Err(CommandError::Interrupted(String::new())),
                ready = self.writer.ready(), if !self.unwritten.is_empty() => {
                    ready?;
                    self.write_next();
                }
                frame = farm.finished(), if arrived < self.frames() => {
                    self.take(arrived, frame.map_err(CommandError::failed)?)?;
                    arrived += 1;
                    progress.completed(arrived, self.totals.fps());
                }
                _ = look.tick() => progress.look(&farm.status()),
            }
        }
        Ok(())
    }

    /// Takes the `place`th frame of the plan.
    fn take(&mut self, place: u64, frame: FinishedFrame) -> Result<(), CommandError> {
        let number = self.number(place);
        self.totals.add(&frame, number)?;
        self.taken.add(number, frame.frame);
        if place + 1 == self.frames() {
            self.totals.hash = self.hash(&frame)?;
        }
        self.unwritten.push_back((number, frame));
        Ok(())
    }

    /// The number of the `place`th frame of the plan.
    fn number(&self, place: u64) -> u64 {
        usize::try_from(place).ok().and_then(|place| self.plan.frames.get(place)).copied().unwrap_or(place)
    }

    /// Of the pixels as they are delivered.
    fn hash(&self, frame: &FinishedFrame) -> Result<blake3::Hash, CommandError> {
        if self.wanted.scale == RenderScale::Full {
            return Ok(blake3::hash(&frame.pixels));
        }
        let FrameView { width, height, .. } = frame.view;
        let rendered = RgbImage { width, height, pixels: frame.pixels.to_vec() };
        let delivered = self.wanted.delivered(rendered).map_err(CommandError::failed)?;
        Ok(blake3::hash(&delivered.pixels))
    }

    fn write_next(&mut self) {
        if let Some((index, frame)) = self.unwritten.pop_front() {
            // A frame without a file keeps its memory, which serves a later frame.
            let FrameView { width, height, .. } = frame.view;
            let wanted = self.wanted;
            self.writer.write(index, || {
                let rendered = RgbImage { width, height, pixels: frame.pixels.into_vec() };
                move || wanted.delivered(rendered)
            });
        }
    }

    fn request_up_to(&mut self, count: u64, farm: &Farm) {
        while self.requested < count.min(self.frames()) {
            farm.request(self.animation.view(&self.wanted.rendered(), self.number(self.requested)));
            self.requested += 1;
        }
    }
}

/// Sums over the frames of a run.
struct Totals {
    started: Instant,
    previous: Duration,
    times: Vec<Duration>,
    latencies: Vec<Duration>,
    rays: RaysPerFrame,
    bytes: BytesPerFrame,
    scene_bytes: u64,
    account: RunAccount,
    verification: Option<VerificationReport>,
    workers: u32,
    threads: u32,
    triangles: u64,
    /// Of the last frame's pixels.
    hash: blake3::Hash,
    rate: FrameRate,
    log: Option<FpsLog<BufWriter<File>>>,
}

impl Totals {
    fn new(triangles: u64, log: Option<FpsLog<BufWriter<File>>>) -> Self {
        Self {
            started: Instant::now(),
            previous: Duration::ZERO,
            times: Vec::new(),
            latencies: Vec::new(),
            rays: RaysPerFrame::default(),
            bytes: BytesPerFrame::default(),
            scene_bytes: 0,
            account: RunAccount::default(),
            verification: None,
            workers: 0,
            threads: 0,
            triangles,
            hash: blake3::hash(&[]),
            rate: FrameRate::default(),
            log,
        }
    }

    /// The first frame is asked for now.
    fn begin(&mut self) {
        self.started = Instant::now();
    }

    fn add(&mut self, frame: &FinishedFrame, number: u64) -> Result<(), CommandError> {
        let at = self.started.elapsed();
        // Frames overlap: the time that both took counts for the earlier one only.
        let elapsed = frame.elapsed.min(at - self.previous);
        self.previous = at;
        self.rate.completed(at, elapsed);
        let line = FrameLine::of(frame, number, at, elapsed, self.rate.fps(at));
        self.times.push(elapsed);
        self.latencies.push(frame.latency);
        self.rays.add(line.rays);
        self.bytes.add(line.bytes);
        self.scene_bytes = self.scene_bytes.saturating_add(frame.scene_bytes);
        self.account.add(&frame.account);
        (self.workers, self.threads) = (frame.workers, frame.threads);
        self.log.as_mut().map_or(Ok(()), |log| log.add(&line))
    }

    fn fps(&self) -> f64 {
        self.rate.fps(self.started.elapsed())
    }

    /// Frames a second over the whole run, up to its last frame.
    fn mean_fps(&self) -> f64 {
        let seconds = self.previous.as_secs_f64();
        if seconds > 0.0 { self.times.len() as f64 / seconds } else { 0.0 }
    }

    /// What a run did, for people.
    fn summary(&self, written: u64, plan: &Plan, has_files: bool) -> String {
        let (rendered, planned) = (self.times.len(), plan.frames.len());
        let rate = match self.times.len() {
            0 => String::new(),
            _ => format!(", {} FPS", three_digits(self.mean_fps())),
        };
        let seconds = self.started.elapsed().as_secs_f64();
        match has_files {
            true => {
                format!("{written} of {planned} frames written in {seconds:.1} s{rate}{}", plan.already())
            }
            false => {
                let ms = MsPerFrame::of(&self.times).median;
                format!(
                    "{rendered} of {planned} frames rendered in {seconds:.1} s{rate}, median {ms:.1} ms; no file is written \
                     (-o none)"
                )
            }
        }
    }

    fn report(&self, wanted: &ViewRequest, plan: &Plan) -> RenderReport {
        let view = &wanted.view;
        let frames = u32::try_from(self.times.len()).unwrap_or(u32::MAX);
        RenderReport {
            frames,
            skipped: plan.skipped,
            fps: (self.mean_fps() * 1e3).round() / 1e3,
            width: view.width,
            height: view.height,
            samples: view.samples,
            quality: wanted.knobs(),
            workers: self.workers,
            threads: self.threads,
            triangles: self.triangles,
            rays_per_frame: self.rays.mean(frames),
            ms_per_frame: MsPerFrame::of(&self.times),
            latency_ms: MsPerFrame::of(&self.latencies),
            bytes_per_frame: BytesPerFrame {
                sent: mean(self.bytes.sent, frames),
                received: mean(self.bytes.received, frames),
            },
            scene_bytes: self.scene_bytes,
            accounting: self.account.report(),
            verification: self.verification.clone(),
            blake3: self.hash.to_hex().to_string(),
        }
    }
}
