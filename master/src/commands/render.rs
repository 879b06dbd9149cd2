//! `render`: frames to files, no display needed.

use std::collections::VecDeque;
use std::fs::File;
use std::io::BufWriter;
use std::time::{Duration, Instant};

use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::scene::{FrameView, RenderScale};
use tokio_util::sync::CancellationToken;

use super::interrupt::cancelled_by_signals;
use super::ladder::within;
use super::oversight::Oversight;
use super::source::{Source, animation};
use crate::accounting::RunAccount;
use crate::cli::RenderArgs;
use crate::display::frame_rate::FrameRate;
use crate::error::CommandError;
use crate::farm::{Farm, FarmOptions, FarmScene, FinishedFrame, Verification};
use crate::orbit::Animation;
use crate::output::{FrameWriter, OutputPattern, check_writable};
use crate::progress::Progress;
use crate::report::{
    BytesPerFrame, FpsLog, FrameLine, MsPerFrame, RaysPerFrame, RenderReport, VerificationReport, mean,
    print_json,
};
use crate::wanted::WantedPicture;

/// The frame being rendered and the one after it, so that workers never run dry between two frames.
const OPEN_REQUESTS: u64 = 2;
/// With so many pictures waiting for the disk, no more are asked for.
const MAX_UNWRITTEN: usize = 2;
/// How often the progress display looks at the farm.
const LOOK_EVERY: Duration = Duration::from_millis(200);
/// How long local workers may take to come before the run begins without them, and how often that is looked at.
const MUSTER: Duration = Duration::from_secs(5);
const MUSTER_LOOK: Duration = Duration::from_millis(2);
/// How long what is left to verify may take when the last frame is complete.
const VERIFICATION: Duration = Duration::from_secs(30);

/// Renders all frames and writes them.
///
/// # Errors
/// A wrong scene or output, found before anything is rendered; a farm that cannot listen or go on; a full disk; an
/// interruption.
pub(super) fn run(args: RenderArgs) -> Result<(), CommandError> {
    let pattern = OutputPattern::parse(&args.output, args.frames)?;
    pattern.path(0).as_deref().map(check_writable).transpose()?;
    let source = Source::load(&args.scene)?;
    let wanted = within(&args.error, &source, source.wanted(&args.picture)?)?;
    let triangles = source.compiled()?.triangle_count();
    let log = args.fps_log.as_deref().map(FpsLog::create).transpose()?;
    let oversight = Oversight::new(&args.oversight)?;
    let run = Run {
        wanted,
        animation: animation(&args.picture, args.frames),
        frames: u64::from(args.frames),
        requested: 0,
        wait_for_workers: args.wait_for_workers,
        unwritten: VecDeque::new(),
        writer: FrameWriter::new(pattern),
        totals: Totals::new(triangles, log),
        oversight,
    };
    let scene = FarmScene { scene: source.scene, meshes: source.meshes, textures: source.textures };
    let report = super::runtime()?.block_on(run.carry_out(args.farm.options(), scene))?;
    if args.json {
        print_json(&report)?;
    }
    Ok(())
}

/// One run of `render`.
struct Run {
    wanted: WantedPicture,
    animation: Animation,
    frames: u64,
    requested: u64,
    /// So many must be there before the run begins, however long that takes.
    wait_for_workers: Option<u32>,
    /// Pictures that the writer has no room for yet.
    unwritten: VecDeque<(u64, FinishedFrame)>,
    writer: FrameWriter,
    totals: Totals,
    oversight: Oversight,
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
        if let Err(error) = self.oversight.begin(&farm, &interrupted) {
            farm.shut_down().await;
            return Err(error);
        }
        let mut progress = Progress::new(self.frames, farm.address(), local_workers);
        self.muster(&farm, local_workers, &mut progress, &interrupted).await;
        self.totals.begin();
        let rendered = self.render(&mut farm, &mut progress, &interrupted).await;
        let written = self.writer.finish().await;
        progress.finish(self.writer.written());
        self.totals.verification = self.verify(&farm, &interrupted).await;
        farm.shut_down().await;
        let traced = self.oversight.end();
        match rendered.and(written).and(traced) {
            Err(CommandError::Interrupted(_)) => Err(CommandError::Interrupted(format!(
                "{} of {} frames are written",
                self.writer.written(),
                self.frames
            ))),
            result => result.map(|()| self.totals.report(&self.wanted)),
        }
    }

    /// Waits, not for ever, until the last frames are verified, where frames are.
    async fn verify(&self, farm: &Farm, interrupted: &CancellationToken) -> Option<VerificationReport> {
        farm.status().verification?;
        tokio::select! {
            () = interrupted.cancelled() => {}
            _ = tokio::time::timeout(VERIFICATION, farm.verified()) => {}
        }
        let counts = farm.status().verification?;
        if counts.mismatches > 0 {
            let Verification { verified, mismatches, .. } = counts;
            tracing::error!(
                "{mismatches} of {verified} verified segments were wrong: frames that were complete before their worker \
                 was found out may be, too; render them again"
            );
        }
        Some(VerificationReport::of(counts))
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
        while arrived < self.frames || !self.unwritten.is_empty() {
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
                frame = farm.finished(), if arrived < self.frames => {
                    self.take(arrived, frame.map_err(CommandError::failed)?)?;
                    arrived += 1;
                    progress.completed(arrived, self.totals.fps());
                }
                _ = look.tick() => progress.look(&farm.status()),
            }
        }
        Ok(())
    }

    fn take(&mut self, index: u64, frame: FinishedFrame) -> Result<(), CommandError> {
        self.totals.add(&frame)?;
        if index + 1 == self.frames {
            self.totals.hash = self.hash(&frame)?;
        }
        self.unwritten.push_back((index, frame));
        Ok(())
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
        while self.requested < count.min(self.frames) {
            farm.request(self.animation.view(&self.wanted.rendered(), self.requested));
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

    fn add(&mut self, frame: &FinishedFrame) -> Result<(), CommandError> {
        let at = self.started.elapsed();
        // Frames overlap: the time that both took counts for the earlier one only.
        let elapsed = frame.elapsed.min(at - self.previous);
        self.previous = at;
        self.rate.completed(at, elapsed);
        let line = FrameLine::of(frame, self.times.len() as u64, at, elapsed, self.rate.fps(at));
        self.times.push(elapsed);
        self.latencies.push(frame.latency);
        self.rays.add(line.rays);
        self.bytes.add(line.bytes);
        self.scene_bytes += frame.scene_bytes;
        self.account.add(&frame.account);
        (self.workers, self.threads) = (frame.workers, frame.threads);
        self.log.as_mut().map_or(Ok(()), |log| log.add(&line))
    }

    fn fps(&self) -> f64 {
        self.rate.fps(self.started.elapsed())
    }

    fn report(&self, wanted: &WantedPicture) -> RenderReport {
        let view = &wanted.view;
        let frames = u32::try_from(self.times.len()).unwrap_or(u32::MAX);
        RenderReport {
            frames,
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
            verification: self.verification,
            blake3: self.hash.to_hex().to_string(),
        }
    }
}
