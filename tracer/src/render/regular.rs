//! The same samples in every pixel.

use std::ops::Range;

use super::RayCounts;
use super::encode::{Means, Place, write_samples};
use super::traced::{Scratch, trace};
use crate::cancel::Cancelled;
use crate::frame::PreparedFrame;
use crate::shade::Colors;
use crate::simd::{LANES, Simd, three};
use crate::stage::{Stage, Watch};
use crate::tile::visible::EyeTile;
use crate::tile::{BLOCKS, Rays, SIDE, place};

/// The pixels of a tile that are asked for.
pub(super) struct Pixels {
    pub left: u32,
    pub right: u32,
    /// First row of the tile; `rows` may begin later.
    pub top: u32,
    pub rows: Range<u32>,
}

/// Tiles that share a band of rows.
#[inline(always)]
pub(super) fn render_band<S: Simd, W: Watch>(
    simd: S,
    frame: &PreparedFrame,
    rows: Range<u32>,
    out: &mut [u8],
    cancelled: &dyn Fn() -> bool,
    watch: &mut W,
) -> Result<RayCounts, Cancelled> {
    watch.enter(Stage::Visible);
    let rays = Rays::grid(simd);
    let mut scratch = Scratch::new(frame, cancelled);
    // Whole pixels, with all their samples.
    let side = frame.tile_rows();
    let grid = frame.rays.grid();
    let mut counts = RayCounts::default();
    for left in (0..frame.width()).step_by(side as usize) {
        let pixels = Pixels {
            left,
            right: (left + side).min(frame.width()),
            // Tiles stand on a grid of the whole frame, wherever the rows are cut.
            top: rows.start / side * side,
            rows: rows.clone(),
        };
        let half = SIDE as f64 / 2.0;
        let center = [f64::from(pixels.left * grid) + half, f64::from(pixels.top * grid) + half];
        let live = live_lanes(grid, &pixels);
        let tile = EyeTile::new(frame, &rays, live, center, grid);
        let colors = trace(simd, &tile, &mut scratch, &mut counts, watch)?;
        watch.enter(Stage::Encoding);
        if grid == 1 {
            write_samples(simd, frame, &pixels, colors, &live, out);
        } else {
            write_means(simd, frame, &pixels, colors, out);
        }
        watch.enter(Stage::Visible);
    }
    Ok(counts)
}

/// Samples of the pixels that are asked for.
fn live_lanes(grid: u32, pixels: &Pixels) -> [u32; BLOCKS] {
    let columns = (pixels.right - pixels.left) * grid;
    let rows = (pixels.rows.start - pixels.top) * grid..(pixels.rows.end - pixels.top) * grid;
    lanes_of(columns, rows)
}

/// The lanes of a tile in its first so many columns, and in these of its rows.
pub(super) fn lanes_of(columns: u32, rows: Range<u32>) -> [u32; BLOCKS] {
    if columns as usize >= SIDE && rows.start == 0 && rows.end as usize >= SIDE {
        return [0xffff; BLOCKS];
    }
    std::array::from_fn(|block| {
        (0..LANES).fold(0, |bits, lane| {
            let (column, row) = place(block, lane);
            bits | u32::from((column as u32) < columns && rows.contains(&(row as u32))) << lane
        })
    })
}

/// Several samples a pixel: the mean in linear light, summed in the order of the samples.
#[inline(always)]
fn write_means<S: Simd>(simd: S, frame: &PreparedFrame, pixels: &Pixels, colors: &Colors, out: &mut [u8]) {
    let grid = frame.rays.grid() as usize;
    let mut means = Means::of((grid * grid) as f32, frame, &pixels.rows);
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
            means.push(simd, sum, Place::of(frame, &pixels.rows, x, y), out);
        }
    }
    means.finish(simd, out);
}
