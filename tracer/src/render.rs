//! Rows of a frame, as bytes: generate rays, shade, average, encode.

use std::ops::{AddAssign, Range};

use crate::frame::PreparedFrame;
use crate::image;
use crate::scene::ColorDepth;
use crate::shade::{self, Colors};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, dispatch, each_bit, splat, three};
use crate::srgb;
use crate::stage::{Stage, Watch};
use crate::tile::visible::{EyeTile, Visible};
use crate::tile::{self, BLOCKS, Rays, SIDE, place};

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
    let mut counts = RayCounts::default();
    let mut top = rows.start;
    while top < rows.end {
        if cancelled() {
            return Err(Cancelled);
        }
        let bottom = (top + 1).next_multiple_of(tile_pixels(frame)).min(rows.end);
        let start = (top - rows.start) as usize * row_bytes;
        let band = &mut out[start..start + (bottom - top) as usize * row_bytes];
        let done = dispatch!(frame.level, simd => render_band(simd, frame, top..bottom, band, &mut *watch));
        if frame.view().quality.colors == ColorDepth::Reduced {
            image::reduce_colors(band);
        }
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
fn render_band<S: Simd, W: Watch>(
    simd: S,
    frame: &PreparedFrame,
    rows: Range<u32>,
    out: &mut [u8],
    watch: &mut W,
) -> RayCounts {
    watch.enter(Stage::Visible);
    let rays = Rays::grid(simd);
    let mut scratch = Scratch::new(frame);
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
        render_tile(simd, frame, &rays, &pixels, &mut scratch, out, &mut counts, watch);
    }
    counts
}

/// Room for a tile, kept from tile to tile.
struct Scratch {
    visible: Visible,
    tile: tile::Scratch,
    shade: shade::Scratch,
}

impl Scratch {
    fn new(frame: &PreparedFrame) -> Self {
        Self { visible: Visible::empty(), tile: tile::Scratch::new(), shade: shade::Scratch::new(frame) }
    }
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
#[expect(clippy::too_many_arguments, reason = "what a band lends each of its tiles")]
fn render_tile<S: Simd, W: Watch>(
    simd: S,
    frame: &PreparedFrame,
    rays: &Rays,
    pixels: &Pixels,
    scratch: &mut Scratch,
    out: &mut [u8],
    counts: &mut RayCounts,
    watch: &mut W,
) {
    watch.enter(Stage::Visible);
    let grid = frame.rays.grid();
    let corner = (pixels.left * grid, pixels.top * grid);
    let tile = EyeTile::new(frame, rays, live_lanes(grid, pixels), corner);
    for lanes in tile.live {
        counts.primary += u64::from(lanes.count_ones());
    }
    let Scratch { visible, tile: room, shade: shading } = scratch;
    tile.find_visible(simd, visible, room);
    shade::shade(simd, &tile, visible, shading, room, counts, watch);
    watch.enter(Stage::Encoding);
    let colors = &shading.colors;
    if grid == 1 {
        write_samples(simd, frame, pixels, colors, &tile.live, out);
    } else {
        write_means(simd, frame, pixels, colors, out);
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
        if live[block] == 0 {
            continue;
        }
        let encoded = srgb::encode_lanes(simd, Vec3x16::load(simd, &colors[block]));
        for row_of_block in 0..4 {
            let (first, encoded) = (row_of_block * 4, &encoded[row_of_block * 16..][..12]);
            let (column, row) = place(block, first);
            match live[block] >> first & 0xf {
                0 => {}
                0xf => {
                    let at = offset(frame, pixels, pixels.left + column as u32, pixels.top + row as u32);
                    out[at..at + 12].copy_from_slice(encoded);
                }
                some => {
                    for lane in each_bit(some) {
                        let x = pixels.left + (column + lane) as u32;
                        let at = offset(frame, pixels, x, pixels.top + row as u32);
                        out[at..at + 3].copy_from_slice(&encoded[3 * lane..3 * lane + 3]);
                    }
                }
            }
        }
    }
}

/// Several samples a pixel: the mean in linear light, summed in the order of the samples.
#[inline(always)]
fn write_means<S: Simd>(simd: S, frame: &PreparedFrame, pixels: &Pixels, colors: &Colors, out: &mut [u8]) {
    let grid = frame.rays.grid() as usize;
    let mut batch = Batch { sums: [Lanes::ZERO; 3], places: [0; LANES], count: 0 };
    for y in pixels.rows.start..pixels.rows.end {
        for x in pixels.left..pixels.right {
            let (column, row) = ((x - pixels.left) as usize * grid, (y - pixels.top) as usize * grid);
            let mut sum = [0.0; 3];
            for row in row..row + grid {
                for column in column..column + grid {
                    let color = &colors[row / 4 * 4 + column / 4];
                    let lane = row % 4 * 4 + column % 4;
                    sum = three!(channel => sum[channel] + color[channel].0[lane]);
                }
            }
            batch.push(sum, offset(frame, pixels, x, y));
            if batch.count == LANES {
                batch.write(simd, grid, out);
            }
        }
    }
    batch.write(simd, grid, out);
}

/// Sums of samples of up to sixteen pixels, and where the pixels' bytes stand.
struct Batch {
    sums: [Lanes; 3],
    places: [usize; LANES],
    count: usize,
}

impl Batch {
    fn push(&mut self, sum: [f32; 3], place: usize) {
        for channel in 0..3 {
            self.sums[channel].0[self.count] = sum[channel];
        }
        self.places[self.count] = place;
        self.count += 1;
    }

    #[inline(always)]
    fn write<S: Simd>(&mut self, simd: S, grid: usize, out: &mut [u8]) {
        let samples = splat(simd, (grid * grid) as f32);
        let sums = Vec3x16::load(simd, &self.sums);
        let encoded = srgb::encode_lanes(simd, Vec3x16(three!(channel => sums.0[channel] / samples)));
        for pixel in 0..self.count {
            let (at, from) = (self.places[pixel], pixel / 4 * 16 + pixel % 4 * 3);
            out[at..at + 3].copy_from_slice(&encoded[from..from + 3]);
        }
        self.count = 0;
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

    /// Every kind of light, primitive, normal, exponent and texture, on every level that this machine has.
    #[test]
    fn all_levels_of_simd_render_the_same_bytes() {
        for scene in ["lights.toml", "room.toml", "textured.toml"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(scene);
            let loaded = crate::scene::load(&path).unwrap();
            let view = FrameView { width: 150, height: 110, samples: 4, ..FrameView::of(&loaded.scene) };
            let compiled =
                Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures).unwrap());
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
