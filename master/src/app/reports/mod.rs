//! What a run is told as: one line of JSON, and a CSV line per frame.

use std::io::{self, Write};
use std::time::Duration;

use serde::Serialize;

use crate::accounting::AccountReport;
use crate::app::error::CommandError;
use crate::farm::Verification;
use crate::viewer::frame_counts::{BytesPerFrame, RaysPerFrame};
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

#[cfg(test)]
mod tests;
