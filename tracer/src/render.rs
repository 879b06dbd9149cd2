//! Rows of a frame, as bytes: generate rays, shade, average, encode.

use std::ops::{AddAssign, Range};

use glam::Vec3;

use crate::frame::PreparedFrame;
use crate::{shade, srgb};

/// Rows and columns of a tile. Segments that begin and end on multiples of it waste nothing.
pub const TILE_SIZE: u32 = 8;

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

/// Rendering was told to stop; what `out` holds is not a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("rendering was cancelled")]
pub struct Cancelled;

/// Traces the rows `rows` of a frame into `out`: `rows.len() * width * 3` bytes, RGB8 sRGB, top to bottom.
///
/// A pixel depends on the scene, the view and its place in the picture alone, so frames may be cut into rows in any
/// way. `cancelled` is asked before each band of at most [`TILE_SIZE`] rows.
///
/// # Errors
/// [`Cancelled`], when `cancelled` says so.
///
/// # Panics
/// If `rows` leaves the frame, or `out` has another length.
pub fn render_rows(
    frame: &PreparedFrame,
    rows: Range<u32>,
    out: &mut [u8],
    cancelled: &dyn Fn() -> bool,
) -> Result<RayCounts, Cancelled> {
    let row_bytes = frame.width() as usize * 3;
    assert!(rows.end <= frame.height(), "rows {rows:?} of a frame of {} rows", frame.height());
    assert_eq!(out.len(), rows.len() * row_bytes, "bytes for rows {rows:?}");
    let mut counts = RayCounts::default();
    let mut top = rows.start;
    while top < rows.end {
        if cancelled() {
            return Err(Cancelled);
        }
        let bottom = (top + 1).next_multiple_of(TILE_SIZE).min(rows.end);
        let start = (top - rows.start) as usize * row_bytes;
        let band = &mut out[start..start + (bottom - top) as usize * row_bytes];
        render_band(frame, top..bottom, band, &mut counts);
        top = bottom;
    }
    Ok(counts)
}

/// A band tile by tile, so that rays that follow each other walk the same nodes.
fn render_band(frame: &PreparedFrame, rows: Range<u32>, out: &mut [u8], counts: &mut RayCounts) {
    let width = frame.width();
    for left in (0..width).step_by(TILE_SIZE as usize) {
        for y in rows.clone() {
            for x in left..(left + TILE_SIZE).min(width) {
                let index = ((y - rows.start) as usize * width as usize + x as usize) * 3;
                out[index..index + 3].copy_from_slice(&srgb::encode(pixel(frame, x, y, counts)));
            }
        }
    }
}

/// The mean of a pixel's samples, linear RGB.
pub(crate) fn pixel(frame: &PreparedFrame, x: u32, y: u32, counts: &mut RayCounts) -> Vec3 {
    let samples = frame.rays.samples();
    let sum: Vec3 = (0..samples).map(|i| shade::radiance(frame, frame.rays.direction(x, y, i), counts)).sum();
    sum / samples as f32
}
