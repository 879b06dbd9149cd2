//! `render`: frames to files, without a screen.

use std::time::Duration;

use rayfarm_tracer::scene::{FrameView, PixelFormat, RenderScale};
use tokio::runtime::Runtime;
use tokio_util::sync::CancellationToken;

use denoised::{Denoised, with_guides};
use files::{FileDisplay, FrameFiles};
use passes::PassRules;
use rayfarm_farm::{Farm, FarmScene, ViewRequest};
use repair::named;
use totals::Totals;

use super::interrupt::cancelled_by_signals;
use super::observability::Observability;
use super::quality::within_error;
use super::source::{Source, animation};
use crate::app::cli::{FarmArgs, RenderArgs};
use crate::app::frame_writer::FrameWriter;
use crate::app::output::{OutputPattern, check_writable};
use crate::app::picture::{BEAUTY, DENOISED};
use crate::app::plan::{Existing, Plan};
use crate::app::progress::Progress;
use crate::app::reports::{RenderReport, print_json};
use crate::app::trust;
use crate::display::Display;
use crate::error::CommandError;
use crate::viewer::orbit::Animation;
use crate::viewer::{FrameLogFile, KeyedScene, Viewer};

mod denoised;
mod files;
mod film_file;
mod keyed;
mod passes;
mod repair;
#[cfg(test)]
mod tests;
mod totals;
mod video;

/// Time that local workers have to connect before the run begins without them, and the interval of looking for them.
const STARTUP_TIMEOUT: Duration = Duration::from_secs(5);
const STARTUP_POLL: Duration = Duration::from_millis(2);

/// Renders all frames and writes them.
///
/// # Errors
/// A wrong scene or output, found before anything is rendered; a farm that cannot listen or go on; a full disk; an
/// interruption; frames with wrong pixels that could not be rendered again.
pub(super) fn run(args: RenderArgs) -> Result<(), CommandError> {
    let pattern = OutputPattern::parse(&args.output, args.frames.unwrap_or(1))?;
    pattern.path(args.first_frame.into()).as_deref().map(check_writable).transpose()?;
    video::check(&args, &pattern)?;
    let source = Source::load(&args.scene, args.models, args.picture.size)?;
    let frames = keyed::frames(&args, &pattern, &source);
    let request = within_error(&args.error, &source, source.request(&args.picture)?)?;
    let request = in_format_of(&args, &pattern, request)?;
    let keys = keyed::keys(&args, &source);
    let first = keys.as_ref().map_or(request, |keys| keys.request(&request, 0));
    let passes = PassRules::of(&args, &source, &first, frames)?;
    let (request, denoised) = denoised_of(&args, request)?;
    let plan = plan(&args, frames, &pattern, &request)?;
    keyed::check(keys.as_ref(), &request, &plan)?;
    let runtime = super::runtime()?;
    // Before any file is begun: an interruption leaves no part of a video.
    let interrupted = runtime.block_on(async { cancelled_by_signals() });
    let video = video::start(&args, &pattern, &request, &plan)?;
    let triangles = source.compiled()?.triangle_count();
    let record_bytes = args.observability.record_bytes();
    let log = args.fps_log.as_deref().map(|path| FrameLogFile::create(path, record_bytes)).transpose()?;
    let observability = Observability::new(&args.observability)?;
    let totals = Totals::new(triangles, log);
    let aov = if args.denoise { with_guides(&args.aov) } else { args.aov };
    let run = Run {
        animation: animation(&args.picture, frames),
        keys,
        wait_for_workers: args.wait_for_workers,
        files: FrameFiles::new(
            request,
            aov,
            denoised,
            plan,
            FrameWriter::new(pattern).with_video(video),
            totals,
        ),
        observability,
        passes,
        samples_so_far: None,
    };
    let scene = FarmScene { scene: source.scene, meshes: source.meshes, textures: source.textures };
    let report = match run.files.plan.frames.is_empty() {
        true => run.nothing_to_do()?,
        false => run.carry_out(&runtime, &args.farm, scene, &interrupted)?,
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

/// The request in the pixel format of the files.
///
/// # Errors
/// Auxiliary pictures for files without layers, or named twice; a scale below 1 for linear light, which is not resized.
fn in_format_of(
    args: &RenderArgs,
    pattern: &OutputPattern,
    request: ViewRequest,
) -> Result<ViewRequest, CommandError> {
    let refuse = |problem: &str| Err(CommandError::WrongInput(problem.to_owned()));
    if !args.aov.is_empty() && !pattern.has_layers() {
        return refuse("--aov writes layers, which only .exr files have: end the name of the output in .exr");
    }
    if let Some(aov) = args.aov.iter().enumerate().find(|(at, aov)| args.aov[..*at].contains(aov)) {
        return refuse(&format!("--aov names {} twice", aov.1.name()));
    }
    if !pattern.is_linear() {
        return Ok(request);
    }
    if request.scale != RenderScale::Full {
        return refuse("pictures of linear light are not resized: render .exr and .hdr files with --scale 1");
    }
    Ok(ViewRequest { view: FrameView { format: PixelFormat::Linear, ..request.view }, ..request })
}

/// The request for frames of sums in place of those of `request`, and their conversion to the requested format, where noise is filtered.
///
/// # Errors
/// A view without sums of samples.
fn denoised_of(
    args: &RenderArgs,
    request: ViewRequest,
) -> Result<(ViewRequest, Option<Denoised>), CommandError> {
    if !args.denoise {
        return Ok((request, None));
    }
    if let Some(problem) = denoised::refusal(&request.view) {
        return Err(CommandError::WrongInput(problem.to_owned()));
    }
    let denoised = Denoised { format: request.view.format, layers: args.aov.len() };
    let view = FrameView { format: PixelFormat::Sums, ..request.view };
    Ok((ViewRequest { view, ..request }, Some(denoised)))
}

/// The frames to render.
fn plan(
    args: &RenderArgs,
    frames: u32,
    pattern: &OutputPattern,
    request: &ViewRequest,
) -> Result<Plan, CommandError> {
    let FrameView { width, height, .. } = request.view;
    let existing = match (args.resume, args.skip_existing) {
        (true, _) => Existing::Resume { width, height, layers: layers(args) },
        (_, true) => Existing::Skip,
        _ => Existing::Replace,
    };
    Plan::new(args.first_frame.into(), frames.into(), existing, pattern)
}

/// Names of the layers of each file that has layers.
fn layers(args: &RenderArgs) -> Vec<&'static str> {
    let first = if args.denoise { DENOISED } else { BEAUTY };
    std::iter::once(first).chain(args.aov.iter().map(|aov| aov.name())).collect()
}

/// One run of `render`.
struct Run {
    animation: Animation,
    /// Frames of a scene that has keys.
    keys: Option<KeyedScene>,
    /// Number of workers that must be connected before the run begins, however long that takes.
    wait_for_workers: Option<u32>,
    files: FrameFiles,
    observability: Observability,
    /// Rules of pictures that are rendered in passes.
    passes: Option<PassRules>,
    /// Progress of a picture that is rendered in passes, as text.
    samples_so_far: Option<String>,
}

impl Run {
    /// The request for a frame.
    fn request(&self, number: u64) -> ViewRequest {
        let request = self.files.request;
        let request = self.keys.as_ref().map_or(request, |keys| keys.request(&request, number));
        self.animation.request(&request, number)
    }

    /// Starts a farm, renders everything with it, and shuts it down whatever happened.
    fn carry_out(
        mut self,
        runtime: &Runtime,
        args: &FarmArgs,
        scene: FarmScene,
        interrupted: &CancellationToken,
    ) -> Result<RenderReport, CommandError> {
        let local_workers = args.local_workers();
        let mut farm = runtime.block_on(self.start(args, scene, interrupted))?;
        let _announced = runtime.block_on(async { trust::announce(args, &farm.entrance(), interrupted) });
        let mut progress = Progress::new(self.files.count(), farm.entrance(), local_workers);
        runtime.block_on(self.await_workers(&farm, local_workers, &mut progress, interrupted));
        let (farm, rendered) = match self.passes.take() {
            None => self.render(runtime, farm, &mut progress, interrupted)?,
            Some(rules) => {
                let rendering = self.render_in_passes(&mut farm, rules, &mut progress, interrupted);
                let rendered = runtime.block_on(rendering);
                (farm, rendered)
            }
        };
        runtime.block_on(self.conclude(farm, rendered, &mut progress, interrupted))
    }

    async fn start(
        &self,
        args: &FarmArgs,
        scene: FarmScene,
        interrupted: &CancellationToken,
    ) -> Result<Farm, CommandError> {
        let options = args.options(trust::security(args)?);
        let farm = Farm::start(options, scene).await.map_err(CommandError::failed)?;
        if let Err(error) = self.observability.begin(&farm, None, interrupted) {
            farm.shut_down().await;
            return Err(error);
        }
        farm.expect_frames(self.files.pictures());
        Ok(farm)
    }

    /// Waits until the workers are connected, so that figures are of the requested number of workers and do not include the
    /// start of processes. A missing local worker is not awaited for long.
    async fn await_workers(
        &self,
        farm: &Farm,
        local_workers: u32,
        progress: &mut Progress,
        interrupted: &CancellationToken,
    ) {
        let (count, timeout) =
            self.wait_for_workers.map_or((local_workers, STARTUP_TIMEOUT), |count| (count, Duration::MAX));
        let all_connected = async {
            let mut status = farm.status();
            while status.workers.len() < count as usize {
                progress.update(&status);
                tokio::time::sleep(STARTUP_POLL).await;
                status = farm.status();
            }
        };
        tokio::select! {
            () = interrupted.cancelled() => {}
            _ = tokio::time::timeout(timeout, all_connected) => {}
        }
    }

    /// Renders the plan with a viewer on the runtime and the files as its display on this thread. Returns the farm for the
    /// frames that must be rendered again.
    ///
    /// # Errors
    /// A viewer that panicked.
    fn render(
        &mut self,
        runtime: &Runtime,
        farm: Farm,
        progress: &mut Progress,
        interrupted: &CancellationToken,
    ) -> Result<(Farm, Result<(), CommandError>), CommandError> {
        let (files, keys) = (&mut self.files, self.keys.clone());
        let (numbers, auxiliary) = (&files.plan.frames, files.auxiliary());
        let (viewer, handle, sequence) =
            Viewer::sequence(farm, files.request, self.animation, numbers, &auxiliary, keys);
        files.totals.begin();
        let stop = interrupted.clone();
        let rendering = runtime.spawn(async move { viewer.run(&stop).await });
        let display = FileDisplay { runtime, files, sequence, progress, interrupted };
        let written = display.run(handle).map_err(CommandError::from);
        let (farm, rendered) = runtime.block_on(rendering).map_err(CommandError::failed)?;
        Ok((farm, rendered.map_err(CommandError::from).and(written)))
    }

    /// Finishes files, verification and reports, and shuts the farm down.
    async fn conclude(
        mut self,
        mut farm: Farm,
        rendered: Result<(), CommandError>,
        progress: &mut Progress,
        interrupted: &CancellationToken,
    ) -> Result<RenderReport, CommandError> {
        let files = &mut self.files;
        let written = files.writer.conclude(rendered.is_ok(), interrupted).await;
        let FrameFiles { totals, writer, plan, denoised, .. } = files;
        let filtered = if denoised.is_some() { ", denoised" } else { "" };
        progress.finish(&(totals.summary(writer.written(), plan, writer.has_files()) + filtered));
        let verifies = farm.status().verification.is_some();
        if verifies && rendered.is_ok() && written.is_ok() {
            self.repair(&mut farm, interrupted).await;
        }
        self.files.totals.verification = self.verification(&farm);
        farm.shut_down().await;
        let observed = self.observability.end();
        match rendered.and(written).and(observed) {
            Err(CommandError::Interrupted(_)) => Err(CommandError::Interrupted(self.so_far())),
            result => result.map(|()| self.report()),
        }
    }

    /// Progress of an interrupted run.
    fn so_far(&self) -> String {
        let FrameFiles { writer, totals, plan, .. } = &self.files;
        let frames = self.files.count();
        if let Some(samples) = self.samples_so_far.clone().filter(|_| frames == 1) {
            return samples;
        }
        if !writer.has_files() {
            return format!("{} of {frames} frames are rendered", totals.frames());
        }
        if writer.is_video() {
            let rendered = totals.frames();
            return format!(
                "{rendered} of {frames} frames were rendered; a video is written whole or not at all"
            );
        }
        let resume = if frames > 1 { "; the same command with --resume goes on" } else { "" };
        format!("{} of {frames} frames are written{}{resume}", writer.written(), plan.already())
    }

    /// Report of a run whose files all exist.
    fn nothing_to_do(mut self) -> Result<RenderReport, CommandError> {
        tracing::info!("all {} frames are there already: nothing to render", self.files.plan.skipped);
        self.observability.end()?;
        Ok(self.report())
    }

    fn report(&self) -> RenderReport {
        let FrameFiles { totals, request, plan, denoised, .. } = &self.files;
        RenderReport { denoised: denoised.is_some(), ..totals.report(request, plan) }
    }
}
