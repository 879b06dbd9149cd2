//! The coarse pass: one sample at each corner of a pixel, shared by four pixels.

use std::ops::Range;

use super::super::direct::TileContext;
use super::super::regular::lanes_of;
use super::super::stage::{Stage, Watch};
use super::BAND;
use crate::cancel::Cancelled;
use crate::rays::{BLOCKS, SIDE, TileColors, TileRays, TileSamples, place};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, f32x16, three};
use crate::srgb;

/// Rows of corners of a band: one more than rows of pixels.
const ROWS: usize = BAND as usize + 1;

/// Columns of corners in a tile of one row.
const ROW_TILE: u32 = (BLOCKS * LANES) as u32;

/// Colours at the corners of the pixels of a band. Corner (0, 0) is the top left one of the band's first pixel.
pub(super) struct Corners {
    /// Distance from a row to the next: sixteen columns from any pixel are within it.
    stride: usize,
    /// In linear light, by channel.
    linear: [Vec<f32>; 3],
    /// In steps of the encoding, 0 to 255.
    encoded: [Vec<f32>; 3],
}

impl Corners {
    /// Corners of rows of `width` pixels, for [`Corners::trace`] to set.
    pub(super) fn new(width: usize) -> Self {
        let stride = (width + 1).next_multiple_of(ROW_TILE as usize) + LANES;
        let room = || three!(_channel => vec![0.0; ROWS * stride]);
        Self { stride, linear: room(), encoded: room() }
    }

    /// Traces the corners of some rows of pixels, relative to the band, whose first row is row `top` of the frame.
    #[inline(always)]
    pub(super) fn trace<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        top: u32,
        rows: &Range<u32>,
        context: &mut TileContext<'_, W>,
    ) -> Result<(), Cancelled> {
        let frame = context.frame;
        let middle = (SIDE as f64 - 1.0) / 2.0;
        let columns = frame.width() + 1;
        let rays = TileRays::grid(simd);
        for left in (0..columns).step_by(SIDE) {
            let live = lanes_of(columns - left, rows.start..(rows.end + 1).min(BAND));
            let center = [f64::from(left) + middle, f64::from(top) + middle];
            context.trace(simd, TileSamples { rays: &rays, live, center, grid: 1 })?;
            context.watch.enter(Stage::Encoding);
            self.put(simd, &live, &context.direct.colors, left as usize, place);
        }
        if rows.end < BAND {
            return Ok(());
        }
        for left in (0..columns).step_by(ROW_TILE as usize) {
            let live = in_row((columns - left) as usize);
            let rays = TileRays::row(simd, &live);
            let center = [f64::from(left) + f64::from(ROW_TILE - 1) / 2.0, f64::from(top + BAND) + 0.5];
            context.trace(simd, TileSamples { rays: &rays, live, center, grid: 1 })?;
            context.watch.enter(Stage::Encoding);
            self.put(simd, &live, &context.direct.colors, left as usize, |block, lane| {
                (block * LANES + lane, BAND as usize)
            });
        }
        Ok(())
    }

    /// Stores the colours of a tile whose lanes are at `place`, four in a row.
    #[inline(always)]
    fn put<S: Simd>(
        &mut self,
        simd: S,
        live: &[u32; BLOCKS],
        colors: &TileColors,
        left: usize,
        place: impl Fn(usize, usize) -> (usize, usize),
    ) {
        for block in 0..BLOCKS {
            if live[block] == 0 {
                continue;
            }
            let linear = &colors[block];
            let mut encoded = [Lanes::ZERO; 3];
            let color = Vec3x16::load(simd, linear);
            Vec3x16(three!(channel => srgb::unrounded(simd, color.0[channel]))).store(&mut encoded);
            for first in (0..LANES).step_by(4) {
                let (column, row) = place(block, first);
                let at = row * self.stride + left + column;
                for channel in 0..3 {
                    self.linear[channel][at..at + 4].copy_from_slice(&linear[channel].0[first..first + 4]);
                    self.encoded[channel][at..at + 4].copy_from_slice(&encoded[channel].0[first..first + 4]);
                }
            }
        }
    }

    /// Indices of the corners of a pixel.
    #[inline(always)]
    fn around(&self, column: usize, row: usize) -> [usize; 4] {
        let at = row * self.stride + column;
        [at, at + 1, at + self.stride, at + self.stride + 1]
    }

    /// Contrast of the corners of a pixel and another encoded colour: the largest difference in any channel.
    pub(super) fn contrast_with(&self, column: usize, row: usize, other: [f32; 3]) -> f32 {
        let [a, b, c, d] = self.around(column, row);
        let [red, green, blue] = three!(channel => {
            let (of, other) = (&self.encoded[channel], other[channel]);
            let least = of[a].min(of[b]).min(of[c]).min(of[d]).min(other);
            of[a].max(of[b]).max(of[c]).max(of[d]).max(other) - least
        });
        red.max(green).max(blue)
    }

    /// Sum of the colours at the corners of a pixel, in linear light.
    pub(super) fn sum(&self, column: usize, row: usize) -> [f32; 3] {
        let [a, b, c, d] = self.around(column, row);
        three!(channel => {
            let of = &self.linear[channel];
            (of[a] + of[b]) + (of[c] + of[d])
        })
    }

    /// [`Corners::sum`] for sixteen pixels.
    #[inline(always)]
    pub(super) fn sums<S: Simd>(&self, simd: S, column: usize, row: usize) -> Vec3x16<S> {
        let at = self.around(column, row);
        Vec3x16(three!(channel => {
            let [a, b, c, d] = corners(simd, &self.linear[channel], at);
            (a + b) + (c + d)
        }))
    }

    /// Contrasts of the corners of sixteen pixels: the largest difference in any channel.
    #[inline(always)]
    pub(super) fn contrasts<S: Simd>(&self, simd: S, column: usize, row: usize) -> f32x16<S> {
        let at = self.around(column, row);
        let [red, green, blue] = three!(channel => {
            let [a, b, c, d] = corners(simd, &self.encoded[channel], at);
            a.max(b).max(c.max(d)) - a.min(b).min(c.min(d))
        });
        red.max(green).max(blue)
    }
}

#[inline(always)]
fn corners<S: Simd>(simd: S, of: &[f32], [a, b, c, d]: [usize; 4]) -> [f32x16<S>; 4] {
    [
        f32x16::from_slice(simd, &of[a..a + LANES]),
        f32x16::from_slice(simd, &of[b..b + LANES]),
        f32x16::from_slice(simd, &of[c..c + LANES]),
        f32x16::from_slice(simd, &of[d..d + LANES]),
    ]
}

/// Bits of the first `count` lanes of a tile.
fn in_row(count: usize) -> [u32; BLOCKS] {
    std::array::from_fn(|block| {
        let left = count.saturating_sub(block * LANES).min(LANES);
        (1_u32 << left) - 1
    })
}
