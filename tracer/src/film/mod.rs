//! The film: means of samples in linear light, encoded as the pixels of some rows of a frame.
//!
//! ```text
//!   pixel_format   bytes per pixel and their range
//!   encode         means of samples, sixteen pixels at a time
//!   development    from linear light to bytes, in every format
//!   tone           exposure and tone curves
//!   dither         ordered dither, and reduction to fewer colours
//!   sums           exact sums of samples
//!   denoise        sums of samples without most of their noise, for display
//! ```

mod denoise;
mod development;
mod dither;
mod encode;
mod pixel_format;
mod sums;
mod tone;

use std::ops::Range;

use crate::frame::PreparedFrame;
use crate::image::{self, ImageError};
use crate::scene::{ColorDepth, FrameView, PixelFormat, Quality};
use crate::simd;

pub use denoise::{GUIDES, Guides, denoise};
pub(crate) use development::Development;
use dither::Dither;
pub(crate) use encode::{Means, PixelIndex, write_corner_means, write_samples};
pub use sums::{MAX_RADIANCE, PixelSums};

/// The requested pixels of a tile.
pub(crate) struct TilePixels {
    /// First column, and the column behind the last.
    pub left: u32,
    pub right: u32,
    /// First row of the tile; `rows` may begin later.
    pub top: u32,
    /// Requested rows of the frame.
    pub rows: Range<u32>,
}

/// Writes the pixels of some rows of a frame, of which `sums` has the sums of all samples, in the frame's format. Reduction to fewer
/// colours follows for the whole rows: see [`finish_rows`].
pub(crate) fn write_sums(frame: &PreparedFrame, rows: &Range<u32>, sums: &[PixelSums], out: &mut [u8]) {
    let view = frame.view();
    Development::new(frame.level, view, rows.start).write_sums(view.samples, sums, out);
}

/// The same where pixels have different numbers of samples, `counts`.
pub(crate) fn write_counted_sums(
    frame: &PreparedFrame,
    rows: &Range<u32>,
    sums: &[PixelSums],
    counts: &[u32],
    out: &mut [u8],
) {
    let means = sums.iter().zip(counts).map(|(sums, samples)| sums.mean(*samples));
    Development::new(frame.level, frame.view(), rows.start).write_light(means, out);
}

/// Writes the pixels that sums show: whole rows of a view's picture from `first_row` on, after a number of samples, in the view's
/// format. The bytes are those that [`crate::render_rows`] writes for these samples.
///
/// `out` has [`PixelFormat::bytes_per_pixel`] bytes for each sum. What is too much on either side is ignored.
pub fn develop(view: &FrameView, first_row: u32, samples: u32, sums: &[PixelSums], out: &mut [u8]) {
    Development::new(simd::best(), view, first_row).write_sums(samples, sums, out);
    finish_rows(view, first_row, out);
}

/// The pixels that sums of a view's whole picture show without most of their noise: those of [`denoise`], in the view's format, which is
/// not [`PixelFormat::Sums`].
///
/// # Errors
/// Guides of another size than the view, or another number of sums.
pub fn develop_denoised(
    view: &FrameView,
    samples: u32,
    sums: &[PixelSums],
    guides: &Guides,
) -> Result<Vec<u8>, ImageError> {
    let light = denoise(sums, samples, guides)?;
    let mut out = vec![0; view.format.bytes_of(view.width, view.height)];
    develop_light(view, 0, &light, &mut out);
    Ok(out)
}

/// Writes the pixels that show light, linear RGB: whole rows from `first_row` on, as [`develop`] does for the means of sums.
fn develop_light(view: &FrameView, first_row: u32, light: &[[f32; 3]], out: &mut [u8]) {
    Development::new(simd::best(), view, first_row).write_light(light.iter().copied(), out);
    finish_rows(view, first_row, out);
}

/// Reduces the colours of finished rows from `first_row` on, if they are RGB8 and the view's quality has fewer.
pub(crate) fn finish_rows(view: &FrameView, first_row: u32, bytes: &mut [u8]) {
    match view.quality {
        _ if view.format != PixelFormat::Rgb8 => {}
        Quality { colors: ColorDepth::Exact, .. } => {}
        Quality { dither: false, .. } => image::reduce_colors(bytes),
        Quality { dither: true, .. } => dither::reduce_colors(view, first_row, bytes),
    }
}
