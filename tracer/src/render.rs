//! Rows of a frame, as bytes: generate rays, shade, average, encode.

use std::ops::{AddAssign, Range};

use glam::Vec3;

use crate::frame::PreparedFrame;
use crate::shade::{self, Colors};
use crate::simd::{LANES, Simd, dispatch, each_bit, three};
use crate::srgb;
use crate::tile::visible::EyeTile;
use crate::tile::{BLOCKS, Rays, SIDE, place};

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
        let bottom = (top + 1).next_multiple_of(tile_pixels(frame)).min(rows.end);
        let start = (top - rows.start) as usize * row_bytes;
        let band = &mut out[start..start + (bottom - top) as usize * row_bytes];
        let done = dispatch!(frame.level, simd => render_band(simd, frame, top..bottom, band));
        counts += done;
        top = bottom;
    }
    Ok(counts)
}

/// Pixels along a side of a tile: whole pixels, with all their samples.
fn tile_pixels(frame: &PreparedFrame) -> u32 {
    (SIDE as u32 / frame.rays.grid()).max(1)
}

/// Tiles that share a band of rows.
#[inline(always)]
fn render_band<S: Simd>(simd: S, frame: &PreparedFrame, rows: Range<u32>, out: &mut [u8]) -> RayCounts {
    let rays = Rays::grid();
    let side = tile_pixels(frame);
    let mut counts = RayCounts::default();
    for left in (0..frame.width()).step_by(side as usize) {
        let pixels = Pixels {
            left,
            right: (left + side).min(frame.width()),
            // Tiles stand on a grid of the whole frame, wherever the rows are cut.
            top: rows.start / side * side,
            rows: rows.clone(),
        };
        render_tile(simd, frame, &rays, &pixels, out, &mut counts);
    }
    counts
}

/// The pixels of a tile that are asked for.
struct Pixels {
    left: u32,
    right: u32,
    /// First row of the tile; `rows` may begin later.
    top: u32,
    rows: Range<u32>,
}

#[inline(always)]
fn render_tile<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    rays: &Rays,
    pixels: &Pixels,
    out: &mut [u8],
    counts: &mut RayCounts,
) {
    let grid = frame.rays.grid();
    let corner = (pixels.left * grid, pixels.top * grid);
    let tile = EyeTile::new(frame, rays, live_lanes(grid, pixels), corner);
    counts.primary += tile.live.iter().map(|lanes| u64::from(lanes.count_ones())).sum::<u64>();
    let visible = tile.visible(simd);
    let colors = shade::shade(simd, &tile, &visible, counts);
    if grid == 1 {
        write_samples(simd, frame, pixels, &colors, &tile.live, out);
    } else {
        write_means(frame, pixels, &colors, out);
    }
}

/// Samples of the pixels that are asked for.
fn live_lanes(grid: u32, pixels: &Pixels) -> [u32; BLOCKS] {
    let columns = (pixels.right - pixels.left) * grid;
    let rows = (pixels.rows.start - pixels.top) * grid..(pixels.rows.end - pixels.top) * grid;
    if columns as usize == SIDE && rows == (0..SIDE as u32) {
        return [0xffff; BLOCKS];
    }
    std::array::from_fn(|block| {
        (0..LANES).fold(0, |bits, lane| {
            let (column, row) = place(block, lane);
            bits | u32::from((column as u32) < columns && rows.contains(&(row as u32))) << lane
        })
    })
}

/// One sample a pixel: encoded lane by lane.
#[inline(always)]
fn write_samples<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    pixels: &Pixels,
    colors: &Colors,
    live: &[u32; BLOCKS],
    out: &mut [u8],
) {
    for block in 0..BLOCKS {
        let codes = three!(channel => srgb::encode_lanes(simd, colors[block][channel].load(simd)));
        for lane in each_bit(live[block]) {
            let (column, row) = place(block, lane);
            let at = offset(frame, pixels, pixels.left + column as u32, pixels.top + row as u32);
            out[at..at + 3].copy_from_slice(&[codes[0][lane], codes[1][lane], codes[2][lane]]);
        }
    }
}

/// Several samples a pixel: the mean in linear light, summed in the order of the samples.
fn write_means(frame: &PreparedFrame, pixels: &Pixels, colors: &Colors, out: &mut [u8]) {
    let grid = frame.rays.grid();
    let sample = |column: u32, row: u32| {
        let block = row / 4 * 4 + column / 4;
        let lane = row % 4 * 4 + column % 4;
        Vec3::from_array([0, 1, 2].map(|channel| colors[block as usize][channel].0[lane as usize]))
    };
    for y in pixels.rows.clone() {
        for x in pixels.left..pixels.right {
            let (column, row) = ((x - pixels.left) * grid, (y - pixels.top) * grid);
            let samples = (0..grid * grid).map(|i| sample(column + i % grid, row + i / grid));
            let mean = samples.sum::<Vec3>() / (grid * grid) as f32;
            let at = offset(frame, pixels, x, y);
            out[at..at + 3].copy_from_slice(&srgb::encode(mean));
        }
    }
}

/// Where a pixel's bytes stand in the bytes of the rows.
fn offset(frame: &PreparedFrame, pixels: &Pixels, x: u32, y: u32) -> usize {
    ((y - pixels.rows.start) as usize * frame.width() as usize + x as usize) * 3
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use super::*;
    use crate::scene::FrameView;
    use crate::{CompiledScene, simd};

    /// Every kind of light, primitive, normal and exponent, on every level that this machine has.
    #[test]
    fn all_levels_of_simd_render_the_same_bytes() {
        for scene in ["lights.toml", "room.toml"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(scene);
            let loaded = crate::scene::load(&path).unwrap();
            let view = FrameView { width: 150, height: 110, samples: 4, ..FrameView::of(&loaded.scene) };
            let compiled = Arc::new(CompiledScene::new(loaded.scene, loaded.meshes).unwrap());
            let mut frame = PreparedFrame::new(compiled, &view).unwrap();
            let mut bytes_at = |level| {
                frame.level = level;
                let mut bytes = vec![0; 150 * 110 * 3];
                render_rows(&frame, 0..110, &mut bytes, &|| false).unwrap();
                bytes
            };
            let first = bytes_at(simd::best());
            for level in simd::all() {
                assert!(bytes_at(level) == first, "{scene} with {}", simd::name(level));
            }
        }
    }
}
