//! Tiles of samples gathered from single pixels.

use super::super::direct::TileContext;
use super::super::stage::Watch;
use crate::cancel::Cancelled;
use crate::rays::{BLOCKS, TileColors, TileRays, TileSamples};
use crate::simd::{LANES, Simd, three};

/// Places of the samples of a pixel.
pub(super) struct Pattern {
    /// Places of the grid along a side of a pixel.
    grid: u32,
    /// The samples: column and row in the grid.
    samples: Vec<[u8; 2]>,
    /// Lanes of a pixel.
    lanes: usize,
}

impl Pattern {
    /// All samples of a grid, row by row.
    pub(super) fn full(grid: u32) -> Self {
        let side = grid as u8;
        let samples: Vec<[u8; 2]> =
            (0..side).flat_map(|row| (0..side).map(move |column| [column, row])).collect();
        // Most pixels are then within one block.
        let lanes = samples.len().next_multiple_of(4);
        Self { grid, samples, lanes }
    }

    /// One sample at the centre.
    pub(super) fn center() -> Self {
        Self { grid: 1, samples: vec![[0, 0]], lanes: 1 }
    }

    /// Number of samples of a pixel.
    pub(super) fn len(&self) -> usize {
        self.samples.len()
    }

    /// Number of pixels in a tile.
    pub(super) fn per_tile(&self) -> usize {
        BLOCKS * LANES / self.lanes
    }

    /// Block and lane of a sample of a pixel of a tile.
    pub(super) fn lane(&self, pixel: usize, sample: usize) -> (usize, usize) {
        let lane = pixel * self.lanes + sample;
        (lane / LANES, lane % LANES)
    }

    /// Sum of the samples of a pixel of a tile, in their order.
    #[inline(always)]
    pub(super) fn sum(&self, colors: &TileColors, pixel: usize) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for sample in 0..self.len() {
            let (block, lane) = self.lane(pixel, sample);
            sum = three!(channel => sum[channel] + colors[block][channel].0[lane]);
        }
        sum
    }
}

/// The rays of a tile of single pixels, kept from tile to tile.
pub(super) struct Gathered {
    rays: TileRays,
    live: [u32; BLOCKS],
}

impl Gathered {
    /// No rays.
    pub(super) fn new() -> Self {
        Self { rays: TileRays::empty(), live: [0; BLOCKS] }
    }

    /// Traces some pixels, at most [`Pattern::per_tile`], all near `center`: columns and rows of the frame.
    #[inline(always)]
    pub(super) fn trace<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        pattern: &Pattern,
        center: [u32; 2],
        pixels: &[[u32; 2]],
        context: &mut TileContext<'_, W>,
    ) -> Result<(), Cancelled> {
        self.live = [0; BLOCKS];
        let grid = pattern.grid as f32;
        for (pixel, at) in pixels.iter().enumerate() {
            let x = (at[0] as f32 - center[0] as f32) * grid + 0.5;
            let y = (at[1] as f32 - center[1] as f32) * grid + 0.5;
            for (sample, &[column, row]) in pattern.samples.iter().enumerate() {
                let (block, lane) = pattern.lane(pixel, sample);
                self.rays.x[block].0[lane] = x + f32::from(column);
                self.rays.y[block].0[lane] = y + f32::from(row);
                self.live[block] |= 1 << lane;
            }
        }
        self.rays.bound(simd, &self.live);
        let center = center.map(|along| f64::from(along * pattern.grid));
        let samples = TileSamples { rays: &self.rays, live: self.live, center, grid: pattern.grid };
        context.trace(simd, samples)
    }
}
