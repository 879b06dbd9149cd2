//! `--fps-log`: a CSV file with a line per frame.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::Duration;

use rayfarm_farm::FinishedFrame;
use rayfarm_farm::accounting::{PART_COUNT, PART_NAMES};

use super::frame_counts::{BytesPerFrame, RaysPerFrame};

/// Columns before those of [`PART_NAMES`], which are per cent of thread time, and `latency_ms`.
const CSV_HEADER: &str =
    "frame,seconds,ms,fps,workers,threads,primary_rays,shadow_rays,secondary_rays,sent_bytes,received_bytes";

/// Last line of a log that has reached its limit.
const LIMIT_LINE: &str = "# limit reached: later frames are left out";

/// Failure of the frame log.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FrameLogError {
    /// The file cannot be created.
    #[error("{name}: cannot write the frame log: {source}")]
    Create {
        /// Path of the file.
        name: String,
        /// Error of the file system.
        source: io::Error,
    },
    /// A line cannot be written, for instance to a full disk.
    #[error("{name}: {source}")]
    Write {
        /// Path of the file.
        name: String,
        /// Error of the file system.
        source: io::Error,
    },
}

/// One line of the frame log.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FrameLine {
    /// Number of the frame, from 0.
    pub(crate) frame: u64,
    /// Time from the start of the run to the last row.
    pub(crate) at: Duration,
    /// Time that the frame took.
    pub(crate) elapsed: Duration,
    /// Frames per second, smoothed over about a second.
    pub(crate) fps: f64,
    /// Connected workers.
    pub(crate) workers: u32,
    /// Render threads of all workers.
    pub(crate) threads: u32,
    /// Rays of the frame.
    pub(crate) rays: RaysPerFrame,
    /// Bytes on the wire for the frame.
    pub(crate) bytes: BytesPerFrame,
    /// Use of all workers' time since the previous frame, in per cent, in the order of [`PART_NAMES`].
    pub(crate) percent: [f64; PART_COUNT],
    /// Time from the frame's request to its last row.
    pub(crate) latency: Duration,
}

impl FrameLine {
    /// The line of a frame that was completed `at` and counts as having taken `elapsed`.
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

/// A frame log; each line is flushed as soon as it is complete.
#[derive(Debug)]
pub(crate) struct FrameLog<W: Write> {
    out: W,
    name: String,
    /// Bytes that may still be written.
    left: u64,
    /// Whether the line that names the limit is written.
    is_full: bool,
}

/// A frame log in a file.
pub(crate) type FrameLogFile = FrameLog<BufWriter<File>>;

impl FrameLogFile {
    /// Creates the file and writes the names of the columns. A line that would exceed `max_bytes` bytes, and all later ones,
    /// are replaced by one line that names the limit.
    ///
    /// # Errors
    /// A file that cannot be created or written.
    pub(crate) fn create(path: &Path, max_bytes: u64) -> Result<Self, FrameLogError> {
        let name = path.display().to_string();
        let file =
            File::create(path).map_err(|source| FrameLogError::Create { name: name.clone(), source })?;
        Self::new(BufWriter::new(file), name, max_bytes)
    }
}

impl<W: Write> FrameLog<W> {
    fn new(out: W, name: String, max_bytes: u64) -> Result<Self, FrameLogError> {
        let mut log = Self { out, name, left: max_bytes, is_full: false };
        let parts: String = PART_NAMES.iter().map(|part| format!(",{part}_percent")).collect();
        log.write_line(&format!("{CSV_HEADER}{parts},latency_ms"))?;
        Ok(log)
    }

    /// Appends the line of one frame.
    ///
    /// # Errors
    /// A line that cannot be written.
    pub(crate) fn add(&mut self, line: &FrameLine) -> Result<(), FrameLogError> {
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

    fn write_line(&mut self, line: &str) -> Result<(), FrameLogError> {
        if self.is_full {
            return Ok(());
        }
        let bytes = line.len() as u64 + 1;
        self.is_full = bytes > self.left;
        self.left = self.left.saturating_sub(bytes);
        let line = if self.is_full {
            tracing::warn!("{}: the frame log has reached its limit; later frames are left out", self.name);
            LIMIT_LINE
        } else {
            line
        };
        writeln!(self.out, "{line}")
            .and_then(|()| self.out.flush())
            .map_err(|source| FrameLogError::Write { name: self.name.clone(), source })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_ends_at_its_limit_with_one_line_that_names_it() {
        let mut log = FrameLog::new(Vec::new(), "log".to_owned(), 1_000).unwrap();
        (0..100).for_each(|frame| log.add(&FrameLine { frame, ..FrameLine::default() }).unwrap());
        let text = String::from_utf8(log.out).unwrap();
        assert!(text.len() <= 1_000 + LIMIT_LINE.len() + 1, "{} bytes", text.len());
        assert_eq!(text.lines().last(), Some(LIMIT_LINE));
        assert!(text.lines().count() > 3);
        assert_eq!(text.matches(LIMIT_LINE).count(), 1);
    }

    #[test]
    fn each_line_has_the_columns_of_the_header() {
        let mut log = FrameLog::new(Vec::new(), "log".to_owned(), u64::MAX).unwrap();
        let line =
            FrameLine { frame: 3, elapsed: Duration::from_micros(12_345), fps: 80.0, ..FrameLine::default() };
        log.add(&line).unwrap();
        let text = String::from_utf8(log.out).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 2);
        assert_eq!(
            lines[1],
            "3,0.000000,12.345,80.000,0,0,0,0,0,0,0,0.000,0.000,0.000,0.000,0.000,0.000,0.000,0.000"
        );
        let last = "received_bytes,trace_percent,wait_percent,encode_percent,send_percent,decode_percent,\
                    idle_tail_percent,scene_percent,latency_ms";
        assert!(lines[0].ends_with(last));
        assert_eq!(lines[0].split(',').count(), lines[1].split(',').count());
    }
}
