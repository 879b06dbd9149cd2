//! What a run is told as: one line of JSON, and a CSV line per frame.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::Duration;

use serde::Serialize;

use crate::accounting::{AccountReport, PART_COUNT, PART_NAMES};
use crate::app::error::CommandError;
use crate::farm::{FinishedFrame, Verification};
use crate::viewer::view_request::Knobs;

/// What a `render` run did; `--json` prints it as one line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct RenderReport {
    /// Frames rendered.
    pub(crate) frames: u32,
    /// Frames that were on the disk already.
    pub(crate) skipped: u64,
    /// Frames rendered a second, from the first request to the last row.
    pub(crate) fps: f64,
    /// Pixels per row.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
    /// Rays per pixel.
    pub(crate) samples: u32,
    /// Where the knobs stood.
    pub(crate) quality: Knobs,
    /// Workers connected when the last frame was done.
    pub(crate) workers: u32,
    /// Their render threads together.
    pub(crate) threads: u32,
    /// Triangles over all instances.
    pub(crate) triangles: u64,
    /// The mean over the frames.
    pub(crate) rays_per_frame: RaysPerFrame,
    /// Over the frames.
    pub(crate) ms_per_frame: MsPerFrame,
    /// Over the frames: from the request of a frame to its last row.
    pub(crate) latency_ms: MsPerFrame,
    /// The mean over the frames, all workers together.
    pub(crate) bytes_per_frame: BytesPerFrame,
    /// Bytes of scene and frame descriptions sent in the whole run, all workers together.
    pub(crate) scene_bytes: u64,
    /// What became of the workers' time, from the first frame's beginning to the last one's end.
    pub(crate) accounting: AccountReport,
    /// Where segments are verified: how many were.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) verification: Option<VerificationReport>,
    /// Of the last frame's pixels: RGB8 rows, top to bottom.
    pub(crate) blake3: String,
}

/// Segments that were rendered twice.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct VerificationReport {
    /// The share that was asked for.
    pub(crate) percent: u8,
    /// Those that were to be verified.
    pub(crate) picked: u64,
    /// Those that were.
    pub(crate) verified: u64,
    /// Those of which somebody had sent wrong pixels.
    pub(crate) mismatches: u64,
    /// Frames, by the numbers of their files, with rows of workers that sent wrong pixels.
    pub(crate) wrong_frames: Vec<u64>,
    /// Frames that had such rows and were rendered again.
    pub(crate) rendered_again: Vec<u64>,
}

impl VerificationReport {
    pub(crate) fn of(counts: Verification, wrong_frames: Vec<u64>, rendered_again: Vec<u64>) -> Self {
        let Verification { percent, picked, verified, mismatches, .. } = counts;
        Self { percent, picked, verified, mismatches, wrong_frames, rendered_again }
    }
}

/// What a `bench` run measured; `--json` prints it as one line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct BenchReport {
    /// Frames measured.
    pub(crate) frames: u32,
    /// Pixels per row.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
    /// Rays per pixel.
    pub(crate) samples: u32,
    /// Where the knobs stood.
    pub(crate) quality: Knobs,
    /// Render threads.
    pub(crate) threads: usize,
    /// Triangles over all instances.
    pub(crate) triangles: u64,
    /// Reading the scene and its models, and building what has to be built.
    pub(crate) load_ms: f64,
    /// The mean over the frames.
    pub(crate) rays_per_frame: RaysPerFrame,
    /// Over the frames: preparing and tracing.
    pub(crate) ms_per_frame: MsPerFrame,
    /// All rays by all time.
    pub(crate) rays_per_second: f64,
    /// Of the last frame's pixels: RGB8 rows, top to bottom.
    pub(crate) blake3: String,
}

/// Rays of one frame by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct RaysPerFrame {
    /// From the camera.
    pub(crate) primary: u64,
    /// Towards lights.
    pub(crate) shadow: u64,
    /// Reflected and transmitted.
    pub(crate) secondary: u64,
}

impl RaysPerFrame {
    /// The mean of a total over `frames` frames, to the nearest ray.
    pub(crate) fn mean(self, frames: u32) -> Self {
        let mean = |total| mean(total, frames);
        Self { primary: mean(self.primary), shadow: mean(self.shadow), secondary: mean(self.secondary) }
    }

    /// Adds another frame's. Workers count them, and may claim anything.
    pub(crate) fn add(&mut self, other: Self) {
        self.primary = self.primary.saturating_add(other.primary);
        self.shadow = self.shadow.saturating_add(other.shadow);
        self.secondary = self.secondary.saturating_add(other.secondary);
    }

    /// Of all kinds.
    pub(crate) fn total(self) -> u64 {
        self.primary.saturating_add(self.shadow).saturating_add(self.secondary)
    }
}

/// How long frames took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct MsPerFrame {
    /// The fastest.
    pub(crate) min: f64,
    /// Half were faster.
    pub(crate) median: f64,
    /// Nineteen in twenty were faster.
    pub(crate) p95: f64,
    /// The slowest.
    pub(crate) max: f64,
}

impl MsPerFrame {
    /// Of a run's frames; all zero for none.
    pub(crate) fn of(times: &[Duration]) -> Self {
        let mut sorted = times.to_vec();
        sorted.sort_unstable();
        let at = |share| round_to_us(percentile(&sorted, share));
        Self { min: at(0.0), median: at(0.5), p95: at(0.95), max: at(1.0) }
    }
}

/// Bytes on the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct BytesPerFrame {
    /// By the master.
    pub(crate) sent: u64,
    /// By the master.
    pub(crate) received: u64,
}

impl BytesPerFrame {
    /// Adds another frame's.
    pub(crate) fn add(&mut self, other: Self) {
        self.sent = self.sent.saturating_add(other.sent);
        self.received = self.received.saturating_add(other.received);
    }
}

/// `total / count`, rounded to the nearest.
pub(crate) fn mean(total: u64, count: u32) -> u64 {
    let count = u64::from(count.max(1));
    total / count + u64::from(total % count >= count.div_ceil(2))
}

/// The value that `share` (0..=1) of `sorted` lie below, interpolated between neighbours; zero for an empty slice.
pub(crate) fn percentile(sorted: &[Duration], share: f64) -> Duration {
    let Some(last) = sorted.len().checked_sub(1) else { return Duration::ZERO };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (sorted[above] - sorted[below]).mul_f64(place - below as f64)
}

/// Milliseconds, with three digits behind the point: what clocks can tell.
pub(crate) fn round_to_us(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e6).round() / 1e3
}

/// Prints `report` as one line on standard output.
///
/// # Errors
/// A closed or full standard output.
pub(crate) fn print_json(report: &impl Serialize) -> Result<(), CommandError> {
    let line = serde_json::to_string(report).map_err(CommandError::failed)?;
    writeln!(io::stdout().lock(), "{line}")
        .map_err(|error| CommandError::Failed(format!("standard output: {error}")))
}

/// One line of the frame log.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FrameLine {
    /// From 0.
    pub(crate) frame: u64,
    /// Since the run began.
    pub(crate) at: Duration,
    /// What the frame took.
    pub(crate) elapsed: Duration,
    /// Frames a second, smoothed over about a second.
    pub(crate) fps: f64,
    /// Workers connected.
    pub(crate) workers: u32,
    /// Their render threads together.
    pub(crate) threads: u32,
    /// Rays of the frame.
    pub(crate) rays: RaysPerFrame,
    /// Bytes on the wire for the frame.
    pub(crate) bytes: BytesPerFrame,
    /// What became of all workers' time since the frame before, in per cent.
    pub(crate) percent: [f64; PART_COUNT],
    /// From the frame's request to its last row.
    pub(crate) latency: Duration,
}

impl FrameLine {
    /// Of a finished frame, the `index`th, that came `at` and is said to have taken `elapsed`.
    pub(crate) fn of(frame: &FinishedFrame, index: u64, at: Duration, elapsed: Duration, fps: f64) -> Self {
        let counts = &frame.counts;
        Self {
            frame: index,
            at,
            elapsed,
            fps,
            workers: frame.workers,
            threads: frame.threads,
            rays: RaysPerFrame {
                primary: counts.primary,
                shadow: counts.shadow,
                secondary: counts.secondary,
            },
            bytes: BytesPerFrame { sent: frame.sent_bytes, received: frame.received_bytes },
            percent: frame.account.sum().percent(),
            latency: frame.latency,
        }
    }
}

/// `--fps-log`: a CSV file with a line per frame, each on the disk as soon as it is known.
#[derive(Debug)]
pub(crate) struct FpsLog<W: Write> {
    out: W,
    name: String,
}

/// What the columns are; those of [`PART_NAMES`] follow, in per cent of thread time, and milliseconds of latency.
const CSV_HEADER: &str =
    "frame,seconds,ms,fps,workers,threads,primary_rays,shadow_rays,secondary_rays,sent_bytes,received_bytes";

impl FpsLog<BufWriter<File>> {
    /// Creates the file and writes its first line.
    ///
    /// # Errors
    /// A place that cannot be written.
    pub(crate) fn create(path: &Path) -> Result<Self, CommandError> {
        let file = File::create(path).map_err(|error| {
            CommandError::WrongInput(format!("{}: cannot write the frame log: {error}", path.display()))
        })?;
        Self::new(BufWriter::new(file), path.display().to_string())
    }
}

impl<W: Write> FpsLog<W> {
    fn new(out: W, name: String) -> Result<Self, CommandError> {
        let mut log = Self { out, name };
        let parts: String = PART_NAMES.iter().map(|part| format!(",{part}_percent")).collect();
        log.write_line(&format!("{CSV_HEADER}{parts},latency_ms"))?;
        Ok(log)
    }

    /// Adds one frame.
    ///
    /// # Errors
    /// A full disk, for one.
    pub(crate) fn add(&mut self, line: &FrameLine) -> Result<(), CommandError> {
        let FrameLine { frame, at, elapsed, fps, workers, threads, rays, bytes, percent, latency } = line;
        let parts: String = percent.iter().map(|part| format!(",{part:.3}")).collect();
        self.write_line(&format!(
            "{frame},{:.6},{:.3},{fps:.3},{workers},{threads},{},{},{},{},{}{parts},{:.3}",
            at.as_secs_f64(),
            elapsed.as_secs_f64() * 1e3,
            rays.primary,
            rays.shadow,
            rays.secondary,
            bytes.sent,
            bytes.received,
            latency.as_secs_f64() * 1e3,
        ))
    }

    fn write_line(&mut self, line: &str) -> Result<(), CommandError> {
        writeln!(self.out, "{line}")
            .and_then(|()| self.out.flush())
            .map_err(|error| CommandError::Failed(format!("{}: {error}", self.name)))
    }
}

#[cfg(test)]
mod tests;
