//! Reports of runs, as one line of JSON.

mod knobs;

use std::io::{self, Write};
use std::time::Duration;

pub(crate) use knobs::Knobs;
use rayfarm_farm::Verification;
use rayfarm_farm::accounting::AccountReport;
use serde::Serialize;

use crate::error::CommandError;
use crate::quantile::{percentile, round_to_us};
use crate::viewer::frame_counts::{BytesPerFrame, RaysPerFrame};

/// Report of a `render` run; `--json` prints it as one line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct RenderReport {
    /// Frames rendered.
    pub(crate) frames: u32,
    /// Frames whose files existed already.
    pub(crate) skipped: u64,
    /// Frames per second, from the first request to the last row.
    pub(crate) fps: f64,
    /// Pixels per row.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
    /// Rays per pixel.
    pub(crate) samples: u32,
    /// Values of the knobs.
    pub(crate) quality: Knobs,
    /// Whether the noise of the pictures is filtered; left out if not.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(crate) denoised: bool,
    /// Workers connected when the last frame was complete.
    pub(crate) workers: u32,
    /// Render threads of these workers.
    pub(crate) threads: u32,
    /// Triangles over all instances.
    pub(crate) triangles: u64,
    /// Mean rays of a frame.
    pub(crate) rays_per_frame: RaysPerFrame,
    /// Times of the frames.
    pub(crate) ms_per_frame: MsPerFrame,
    /// Times from the request of each frame to its last row.
    pub(crate) latency_ms: MsPerFrame,
    /// Mean bytes of a frame, all workers together.
    pub(crate) bytes_per_frame: BytesPerFrame,
    /// Bytes of scene and frame descriptions sent in the whole run, all workers together.
    pub(crate) scene_bytes: u64,
    /// Use of the workers' time, from the beginning of the first frame to the end of the last one.
    pub(crate) accounting: AccountReport,
    /// Result of verification, where segments are verified.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) verification: Option<VerificationReport>,
    /// The last picture, where pictures are rendered in passes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) film: Option<FilmReport>,
    /// Hash of the last frame's pixels: rows from top to bottom, RGB8, or linear light for .exr and .hdr files. Of the sums of all samples
    /// if `denoised`.
    pub(crate) blake3: String,
}

/// A picture that was rendered in passes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct FilmReport {
    /// Passes that this run rendered.
    pub(crate) passes: u32,
    /// Samples of each pixel, those of earlier runs included.
    pub(crate) samples: u32,
    /// Samples of each pixel that earlier runs rendered.
    pub(crate) continued: u32,
    /// Estimated relative error; `null` for a single sample.
    pub(crate) error: Option<f64>,
}

/// Result of verification: segments that were rendered twice.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct VerificationReport {
    /// Requested share of the segments.
    pub(crate) percent: u8,
    /// Segments picked for verification.
    pub(crate) picked: u64,
    /// Segments verified.
    pub(crate) verified: u64,
    /// Segments of which a worker had sent wrong pixels.
    pub(crate) mismatches: u64,
    /// Frames, by the numbers of their files, with rows of workers that sent wrong pixels.
    pub(crate) wrong_frames: Vec<u64>,
    /// Frames that had such rows and were rendered again.
    pub(crate) rendered_again: Vec<u64>,
}

impl VerificationReport {
    /// The report of a run with these counts.
    pub(crate) fn of(counts: Verification, wrong_frames: Vec<u64>, rendered_again: Vec<u64>) -> Self {
        let Verification { percent, picked, verified, mismatches, .. } = counts;
        Self { percent, picked, verified, mismatches, wrong_frames, rendered_again }
    }
}

/// Report of a `bench` run; `--json` prints it as one line.
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
    /// Values of the knobs.
    pub(crate) quality: Knobs,
    /// Render threads.
    pub(crate) threads: usize,
    /// Triangles over all instances.
    pub(crate) triangles: u64,
    /// Time to load the scene with its models, and to build its hierarchies.
    pub(crate) load_ms: f64,
    /// Mean rays of a frame.
    pub(crate) rays_per_frame: RaysPerFrame,
    /// Times of the frames: preparation and tracing.
    pub(crate) ms_per_frame: MsPerFrame,
    /// Rays of all frames, divided by their time.
    pub(crate) rays_per_second: f64,
    /// Hash of the last frame's pixels: RGB8 rows, top to bottom.
    pub(crate) blake3: String,
}

/// Times of frames, in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct MsPerFrame {
    /// Shortest time.
    pub(crate) min: f64,
    /// Median.
    pub(crate) median: f64,
    /// 95th percentile.
    pub(crate) p95: f64,
    /// Longest time.
    pub(crate) max: f64,
}

impl MsPerFrame {
    /// Statistics of the times of a run; all zero without frames.
    pub(crate) fn of(times: &[Duration]) -> Self {
        let mut sorted = times.to_vec();
        sorted.sort_unstable();
        let at = |share| round_to_us(percentile(&sorted, share));
        Self { min: at(0.0), median: at(0.5), p95: at(0.95), max: at(1.0) }
    }
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
