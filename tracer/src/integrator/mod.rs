//! Rendering: rows of a frame as pixels.
//!
//! ```text
//!   direct     a tile of rays, from its hits to its colours: direct light, shadows, emission, bounces, background
//!   path       a tile of paths, from its rays to the radiance of its samples
//!   background rays without a hit
//!   regular    bands of tiles with the same samples in every pixel
//!   adaptive   bands of tiles with few samples where the picture is smooth, all of them elsewhere
//!   stage      the stages of a tile, for benchmarks
//! ```

mod adaptive;
mod background;
mod direct;
mod path;
mod regular;
mod stage;
#[cfg(test)]
mod tests;

use std::ops::Range;

use crate::cancel::Cancelled;
use crate::film;
use crate::frame::PreparedFrame;
use crate::rays::RayCounts;
use crate::scene::Integrator;
use crate::simd::dispatch;
pub use stage::{Stage, Watch};

/// Renders the rows `rows` of a frame into `out`: [`PreparedFrame::row_bytes`] bytes a row in the frame's
/// [`PixelFormat`](crate::PixelFormat), top to bottom.
///
/// A pixel depends on the scene, the view and its place in the picture alone, so frames may be cut into rows in any way.
/// `cancelled` is polled before each tile of at most [`TILE_SIZE`](crate::TILE_SIZE) rows and columns.
///
/// # Errors
/// [`Cancelled`], when `cancelled` returns `true`; the contents of `out` are then undefined.
///
/// # Panics
/// If `rows` exceeds the frame, or `out` has another length.
pub fn render_rows(
    frame: &PreparedFrame,
    rows: Range<u32>,
    out: &mut [u8],
    cancelled: &dyn Fn() -> bool,
) -> Result<RayCounts, Cancelled> {
    render_rows_watched(frame, rows, out, cancelled, &mut ())
}

/// [`render_rows`] with a `watch` of the stages, for benchmarks. Each type of watch compiles another copy.
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
    let row_bytes = frame.row_bytes();
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
        counts += if let Integrator::Path(settings) = &frame.view().integrator {
            dispatch!(frame.level, simd => path::render_band(simd, frame, settings, top..bottom, band, cancelled, &mut *watch))?
        } else if adaptive {
            dispatch!(frame.level, simd => adaptive::render_band(simd, frame, top..bottom, band, cancelled, &mut *watch))?
        } else {
            dispatch!(frame.level, simd => regular::render_band(simd, frame, top..bottom, band, cancelled, &mut *watch))?
        };
        film::finish_rows(frame.view(), top, band);
        top = bottom;
    }
    Ok(counts)
}
