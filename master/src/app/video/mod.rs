//! Videos: all frames of a run in one file, which appears when it is complete.
//!
//! ```text
//! writer    the thread that encodes, and the file under its temporary name
//! apng      animated PNG: lossless
//! gif       GIF, with the colours of `palette`
//! palette   at most 255 colours of a picture, and its pixels in them
//! ffmpeg    MP4 and WebM, encoded by the program ffmpeg
//! ```
//!
//! Frames stream through: only those that wait for the encoder are in memory.

mod apng;
mod ffmpeg;
mod gif;
mod palette;
mod writer;

use std::path::Path;

use rayfarm_tracer::image::{ImageError, RgbImage};

use crate::viewer::VideoRate;

pub(crate) use writer::VideoWriter;

/// Formats of videos.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum VideoFormat {
    /// Animated PNG.
    Apng,
    /// GIF.
    Gif,
    /// H.264 in MP4.
    Mp4,
    /// VP9 in WebM.
    WebM,
}

impl VideoFormat {
    const EXTENSIONS: [(&'static str, Self); 4] =
        [("apng", Self::Apng), ("gif", Self::Gif), ("mp4", Self::Mp4), ("webm", Self::WebM)];

    /// The format of a file by its extension, if it is a video.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        Self::EXTENSIONS.iter().find(|(known, _)| known.eq_ignore_ascii_case(extension)).map(|(_, it)| *it)
    }

    /// The reason for which this machine cannot write the format, and the remedy.
    pub(crate) fn refusal(self) -> Option<String> {
        match self {
            Self::Apng | Self::Gif => None,
            Self::Mp4 | Self::WebM => ffmpeg::refusal(),
        }
    }
}

/// Properties of a video.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VideoSettings {
    /// Its format.
    pub(crate) format: VideoFormat,
    /// Pixels per row of each frame.
    pub(crate) width: u32,
    /// Rows of each frame.
    pub(crate) height: u32,
    /// Number of frames.
    pub(crate) frames: u32,
    /// Frames per second.
    pub(crate) rate: VideoRate,
}

/// A failure of a video, as text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub(crate) struct VideoError(String);

impl From<ImageError> for VideoError {
    fn from(error: ImageError) -> Self {
        Self::of(&error)
    }
}

impl VideoError {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self(message.into())
    }

    /// A failure of the operating system or of an encoder.
    fn of(error: &impl std::fmt::Display) -> Self {
        Self(error.to_string())
    }
}

/// An encoder of one video.
trait Encoder: Send {
    /// Adds the next frame.
    fn add(&mut self, frame: &RgbImage) -> Result<(), VideoError>;

    /// Completes the file.
    fn finish(self: Box<Self>) -> Result<(), VideoError>;
}
