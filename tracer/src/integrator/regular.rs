//! Bands with the same samples in every pixel.

use std::ops::Range;

use super::direct::TileContext;
use super::stage::{Stage, Watch};
use crate::cancel::Cancelled;
use crate::film::{Means, PixelIndex, TilePixels, write_samples};
use crate::frame::PreparedFrame;
use crate::rays::{BLOCKS, RayCounts, SIDE, TileColors, TileRays, TileSamples, place};
use crate::simd::{LANES, Simd, three};

/// Renders the tiles of a band of rows.
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
    let rays = TileRays::grid(simd);
    let mut context = TileContext::new(frame, cancelled, watch);
    // A tile has whole pixels, with all their samples.
    let side = frame.tile_rows();
    let grid = frame.rays.grid();
    for left in (0..frame.width()).step_by(side as usize) {
        let pixels = TilePixels {
            left,
            right: (left + side).min(frame.width()),
            // Tiles are aligned to the whole frame, not to the requested rows.
            top: rows.start / side * side,
            rows: rows.clone(),
        };
        let half = SIDE as f64 / 2.0;
        let center = [f64::from(pixels.left * grid) + half, f64::from(pixels.top * grid) + half];
        let live = live_lanes(grid, &pixels);
        context.trace(simd, TileSamples { rays: &rays, live, center, grid })?;
        context.watch.enter(Stage::Encoding);
        let colors = &context.direct.colors;
        if grid == 1 {
            write_samples(simd, frame, &pixels, colors, &live, out);
        } else {
            write_means(simd, frame, &pixels, colors, out);
        }
        context.watch.enter(Stage::Visible);
    }
    Ok(context.counts)
}

/// Bits of the samples of the requested pixels.
fn live_lanes(grid: u32, pixels: &TilePixels) -> [u32; BLOCKS] {
    let columns = (pixels.right - pixels.left) * grid;
    let rows = (pixels.rows.start - pixels.top) * grid..(pixels.rows.end - pixels.top) * grid;
    lanes_of(columns, rows)
}

/// Bits of the lanes of a tile in its first `columns` columns and in these of its rows.
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

/// Writes the pixels of a tile with several samples a pixel: means in linear light, summed in the order of the samples.
#[inline(always)]
fn write_means<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    pixels: &TilePixels,
    colors: &TileColors,
    out: &mut [u8],
) {
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
            means.push(simd, sum, PixelIndex::of(frame, &pixels.rows, x, y), out);
        }
    }
    means.finish(simd, out);
}
