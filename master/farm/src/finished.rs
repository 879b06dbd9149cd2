//! A finished frame.

use std::time::Duration;

use rayfarm_protocol::FrameId;
use rayfarm_tracer::image::LinearImage;
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{PixelFormat, PixelSums};

use crate::accounting::FrameAccount;
use crate::framebuffer::FramePixels;
use crate::view_request::ViewRequest;

pub use rayfarm_protocol::Cost as FrameCounts;

/// A completed picture with its costs.
#[derive(Debug)]
pub struct FinishedFrame {
    /// Number of the request that it answers.
    pub frame: FrameId,
    /// The request that it answers.
    pub request: ViewRequest,
    /// The rendered view: the requested one at its scale.
    pub view: FrameView,
    /// Rows in the format of [`Self::format`], top to bottom.
    pub pixels: FramePixels,
    /// The costs of the picture's segments, summed: nanoseconds over all threads, and rays by kind. Each row counts once,
    /// even if several workers rendered it.
    pub counts: FrameCounts,
    /// Time from the start of the frame to its last row.
    pub elapsed: Duration,
    /// Time from the request to the last row: the age of the camera in the picture.
    pub latency: Duration,
    /// Workers that were connected when the frame completed.
    pub workers: u32,
    /// Render threads of these workers together.
    pub threads: u32,
    /// Bytes sent to all workers since the previous frame completed.
    pub sent_bytes: u64,
    /// Bytes received from all workers since the previous frame completed.
    pub received_bytes: u64,
    /// The part of `sent_bytes` that describes what to draw: frame announcements and assets.
    pub scene_bytes: u64,
    /// Thread time of the workers since the previous frame, by use, and the worker of each row.
    pub account: FrameAccount,
}

impl FinishedFrame {
    /// Format of the pixels: the requested one.
    pub fn format(&self) -> PixelFormat {
        self.view.format
    }

    /// The sums of the pixels, rows from top to bottom; `None` in other formats. They are of the samples from
    /// `view.first_sample` on, `view.samples` of them.
    pub fn sums(&self) -> Option<impl ExactSizeIterator<Item = PixelSums>> {
        let sums = self.pixels.as_chunks().0.iter().map(PixelSums::from_bytes);
        (self.format() == PixelFormat::Sums).then_some(sums)
    }

    /// Adds the sums of the pixels to those of other passes of the same picture. Returns whether it did: not in other formats, nor
    /// to a film of another size.
    #[must_use]
    pub fn add_sums_to(&self, film: &mut [PixelSums]) -> bool {
        let Some(sums) = self.sums().filter(|sums| sums.len() == film.len()) else { return false };
        film.iter_mut().zip(sums).for_each(|(pixel, sums)| pixel.add(&sums));
        true
    }

    /// The picture in linear light; `None` in other formats than [`PixelFormat::Linear`].
    pub fn linear(&self) -> Option<LinearImage> {
        let FrameView { width, height, format, .. } = self.view;
        let numbers = || self.pixels.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
        (format == PixelFormat::Linear).then(|| LinearImage { width, height, pixels: numbers().collect() })
    }
}
