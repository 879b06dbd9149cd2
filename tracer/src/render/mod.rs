//! Rows of a frame, as bytes: generate rays, shade, average, encode.

//!
//! ```text
//!   traced     a tile of rays, from what they see to their colours
//!   regular    bands of tiles: the same samples in every pixel
//!   adaptive   bands of tiles: few samples where nothing changes, all of them where something does
//!   encode     means of samples, as bytes
//! ```

mod adaptive;
mod dither;
mod encode;
mod regular;
#[cfg(test)]
mod tests;
mod traced;

use std::ops::{AddAssign, Range};

use crate::cancel::Cancelled;
use crate::frame::PreparedFrame;
use crate::image;
use crate::scene::{ColorDepth, Quality};
use crate::simd::dispatch;
use crate::stage::Watch;
use crate::tile::SIDE;

/// Rows of a tile of a frame with one sample a pixel. Segments that begin and end on multiples of it waste nothing.
pub const TILE_SIZE: u32 = SIDE as u32;

/// Rays traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub primary: u64,
    /// Towards lights.
    pub shadow: u64,
    /// Reflected and transmitted.
    pub secondary: u64,
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        self.primary += other.primary;
        self.shadow += other.shadow;
        self.secondary += other.secondary;
    }
}

/// Traces the rows `rows` of a frame into `out`: `rows.len() * width * 3` bytes, RGB8 sRGB, top to bottom.
///
/// A pixel depends on the scene, the view and its place in the picture alone, so frames may be cut into rows in any
/// way. `cancelled` is asked before each tile of at most [`TILE_SIZE`] rows and columns.
///
/// # Errors
/// [`Cancelled`], when `cancelled` says so; what `out` holds is not a picture then.
///
/// # Panics
/// If `rows` leaves the frame, or `out` has another length.
pub fn render_rows(
    frame: &PreparedFrame,
    rows: Range<u32>,
    out: &mut [u8],
    cancelled: &dyn Fn() -> bool,
) -> Result<RayCounts, Cancelled> {
    render_rows_watched(frame, rows, out, cancelled, &mut ())
}

/// [`render_rows`], told to `watch` stage by stage: for benchmarks. It is compiled once more for each kind of watch.
///
/// # Errors
/// As [`render_rows`].
///
/// # Panics
/// As [`render_rows`].
pub fn render_rows_watched<W: Watch>(
    frame: &PreparedFrame,
    rows: Range<u32>,
    out: &mut [u8],
    cancelled: &dyn Fn() -> bool,
    watch: &mut W,
) -> Result<RayCounts, Cancelled> {
    let row_bytes = frame.width() as usize * 3;
    assert!(rows.end <= frame.height(), "rows {rows:?} of a frame of {} rows", frame.height());
    assert_eq!(out.len(), rows.len() * row_bytes, "bytes for rows {rows:?}");
    let adaptive = frame.view().is_adaptive();
    let band_rows = frame.tile_rows();
    let mut counts = RayCounts::default();
    let mut top = rows.start;
    while top < rows.end {
        let bottom = (top + 1).next_multiple_of(band_rows).min(rows.end);
        let start = (top - rows.start) as usize * row_bytes;
        let band = &mut out[start..start + (bottom - top) as usize * row_bytes];
        counts += if adaptive {
            dispatch!(frame.level, simd => adaptive::render_band(simd, frame, top..bottom, band, cancelled, &mut *watch))?
        } else {
            dispatch!(frame.level, simd => regular::render_band(simd, frame, top..bottom, band, cancelled, &mut *watch))?
        };
        match frame.view().quality {
            Quality { colors: ColorDepth::Exact, .. } => {}
            Quality { dither: false, .. } => image::reduce_colors(band),
            Quality { dither: true, .. } => dither::reduce_colors(frame, &(top..bottom), band),
        }
        top = bottom;
    }
    Ok(counts)
}
