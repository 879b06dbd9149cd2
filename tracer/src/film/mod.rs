//! The film: means of samples in linear light, encoded as the pixels of some rows of a frame.
//!
//! ```text
//!   pixel_format   bytes per pixel and their range
//!   encode         means of samples, sixteen pixels at a time
//!   dither         ordered dither, and reduction to fewer colours
//!   sums           exact sums of samples
//! ```

mod dither;
mod encode;
mod pixel_format;
mod sums;

use std::ops::Range;

use crate::frame::PreparedFrame;
use crate::image;
use crate::scene::{ColorDepth, PixelFormat, Quality};

pub(crate) use dither::Dither;
pub(crate) use encode::{Means, PixelBytes, write_corner_means, write_samples};
pub(crate) use sums::write_sums;
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

/// Reduces the colours of finished rows, if the frame's quality has fewer.
pub(crate) fn finish_rows(frame: &PreparedFrame, rows: &Range<u32>, bytes: &mut [u8]) {
    match frame.view().quality {
        Quality { colors: ColorDepth::Exact, .. } => {}
        Quality { dither: false, .. } => image::reduce_colors(bytes),
        Quality { dither: true, .. } => dither::reduce_colors(frame, rows, bytes),
    }
}
