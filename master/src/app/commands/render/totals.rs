//! Sums over the frames of a run, and their report.

use std::time::{Duration, Instant};

use rayfarm_farm::accounting::RunAccount;
use rayfarm_farm::{FinishedFrame, ViewRequest};

use crate::app::plan::Plan;
use crate::app::reports::{FilmReport, Knobs, MsPerFrame, RenderReport, VerificationReport};
use crate::display::numbers::three_digits;
use crate::error::CommandError;
use crate::viewer::frame_counts::{BytesPerFrame, RaysPerFrame, mean};
use crate::viewer::{FrameLine, FrameLogFile, FrameRate, PresentedFrame};

/// Sums over the frames of a run.
pub(super) struct Totals {
    started: Instant,
    /// Time of the last frame since the start.
    previous: Duration,
    times: Vec<Duration>,
    latencies: Vec<Duration>,
    rays: RaysPerFrame,
    bytes: BytesPerFrame,
    scene_bytes: u64,
    account: RunAccount,
    workers: u32,
    threads: u32,
    triangles: u64,
    rate: FrameRate,
    log: Option<FrameLogFile>,
    /// Hash of the last frame's pixels.
    pub(super) hash: blake3::Hash,
    /// Result of verification, where segments are verified.
    pub(super) verification: Option<VerificationReport>,
    /// The last picture, where pictures are rendered in passes.
    pub(super) film: Option<FilmReport>,
}

impl Totals {
    /// Sums before the first frame.
    pub(super) fn new(triangles: u64, log: Option<FrameLogFile>) -> Self {
        Self {
            started: Instant::now(),
            previous: Duration::ZERO,
            times: Vec::new(),
            latencies: Vec::new(),
            rays: RaysPerFrame::default(),
            bytes: BytesPerFrame::default(),
            scene_bytes: 0,
            account: RunAccount::default(),
            workers: 0,
            threads: 0,
            triangles,
            rate: FrameRate::default(),
            log,
            hash: blake3::hash(&[]),
            verification: None,
            film: None,
        }
    }

    /// Starts the clock, at the request of the first frame.
    pub(super) fn begin(&mut self) {
        self.started = Instant::now();
    }

    /// Adds a frame, and its line to the frame log.
    ///
    /// # Errors
    /// A log that cannot be written.
    pub(super) fn add(&mut self, presented: &PresentedFrame, number: u64) -> Result<(), CommandError> {
        let frame = &presented.frame;
        let at = presented.completed_at.saturating_duration_since(self.started);
        // Frames overlap: the time of both counts for the earlier one only.
        let elapsed = frame.elapsed.min(at.saturating_sub(self.previous));
        self.previous = at;
        self.rate.completed(at, elapsed);
        let line = FrameLine::of(frame, number, at, elapsed, self.rate.fps(at));
        self.times.push(elapsed);
        self.latencies.push(frame.latency);
        self.count(frame, &line)
    }

    /// Adds a pass of a picture, and its line to the frame log; `number` is that of the pass. The time of the picture is added when it is
    /// complete.
    ///
    /// # Errors
    /// A log that cannot be written.
    pub(super) fn add_pass(&mut self, frame: &FinishedFrame, number: u64) -> Result<(), CommandError> {
        let at = self.started.elapsed();
        self.rate.completed(at, frame.elapsed);
        let line = FrameLine::of(frame, number, at, frame.elapsed, self.rate.fps(at));
        self.count(frame, &line)
    }

    /// Adds the time of a picture whose passes have been added.
    pub(super) fn complete_picture(&mut self) {
        let at = self.started.elapsed();
        let elapsed = at.saturating_sub(self.previous);
        self.previous = at;
        self.times.push(elapsed);
        self.latencies.push(elapsed);
    }

    /// Adds the rays, bytes and account of a frame, and its line to the frame log.
    fn count(&mut self, frame: &FinishedFrame, line: &FrameLine) -> Result<(), CommandError> {
        self.rays.add(line.rays);
        self.bytes.add(line.bytes);
        self.scene_bytes = self.scene_bytes.saturating_add(frame.scene_bytes);
        self.account.add(&frame.account);
        (self.workers, self.threads) = (frame.workers, frame.threads);
        if let Some(log) = &mut self.log {
            log.add(line)?;
        }
        Ok(())
    }

    /// Frames rendered.
    pub(super) fn frames(&self) -> usize {
        self.times.len()
    }

    /// Current frames per second.
    pub(super) fn fps(&self) -> f64 {
        self.rate.fps(self.started.elapsed())
    }

    /// Frames per second over the whole run, up to its last frame.
    fn mean_fps(&self) -> f64 {
        let seconds = self.previous.as_secs_f64();
        if seconds > 0.0 { self.times.len() as f64 / seconds } else { 0.0 }
    }

    /// Summary of a run, as one line of text.
    pub(super) fn summary(&self, written: u64, plan: &Plan, has_files: bool) -> String {
        let (rendered, planned) = (self.times.len(), plan.frames.len());
        let rate = match self.times.len() {
            0 => String::new(),
            _ => format!(", {} FPS", three_digits(self.mean_fps())),
        };
        let seconds = self.started.elapsed().as_secs_f64();
        if has_files {
            return format!(
                "{written} of {planned} frames written in {seconds:.1} s{rate}{}",
                plan.already()
            );
        }
        let ms = MsPerFrame::of(&self.times).median;
        format!(
            "{rendered} of {planned} frames rendered in {seconds:.1} s{rate}, median {ms:.1} ms; no file is written (-o none)"
        )
    }

    /// Report of a run that rendered `request`.
    pub(super) fn report(&self, request: &ViewRequest, plan: &Plan) -> RenderReport {
        let view = &request.view;
        let frames = u32::try_from(self.times.len()).unwrap_or(u32::MAX);
        RenderReport {
            frames,
            skipped: plan.skipped,
            fps: (self.mean_fps() * 1e3).round() / 1e3,
            width: view.width,
            height: view.height,
            samples: view.samples,
            quality: Knobs::of(request.setting()),
            denoised: false,
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
            film: self.film,
            blake3: self.hash.to_hex().to_string(),
        }
    }
}
