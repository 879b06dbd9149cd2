//! Samples of single pixels, gathered into tiles.

use super::super::RayCounts;
use super::super::traced::{Scratch, trace};
use crate::cancel::Cancelled;
use crate::frame::PreparedFrame;
use crate::shade::Colors;
use crate::simd::{LANES, Simd, three};
use crate::stage::Watch;
use crate::tile::visible::EyeTile;
use crate::tile::{BLOCKS, Rays};

/// Where a pixel is sampled.
pub(super) struct Pattern {
    /// Samples stand on a grid with so many along a side of a pixel.
    grid: u32,
    /// Which of them: column and row, from the centre of the first one.
    samples: Vec<[u8; 2]>,
    /// Lanes that a pixel takes.
    lanes: usize,
}

impl Pattern {
    /// All samples of a grid, row by row.
    pub(super) fn full(grid: u32) -> Self {
        let side = grid as u8;
        let samples: Vec<[u8; 2]> =
            (0..side).flat_map(|row| (0..side).map(move |column| [column, row])).collect();
        // So that most pixels lie in blocks of their own.
        let lanes = samples.len().next_multiple_of(4);
        Self { grid, samples, lanes }
    }

    /// The centre.
    pub(super) fn center() -> Self {
        Self { grid: 1, samples: vec![[0, 0]], lanes: 1 }
    }

    /// Samples of a pixel.
    pub(super) fn len(&self) -> usize {
        self.samples.len()
    }

    /// Pixels that fit into a tile.
    pub(super) fn per_tile(&self) -> usize {
        BLOCKS * LANES / self.lanes
    }

    /// Block and lane of a sample of a pixel of a tile.
    pub(super) fn lane(&self, pixel: usize, sample: usize) -> (usize, usize) {
        let lane = pixel * self.lanes + sample;
        (lane / LANES, lane % LANES)
    }

    /// The samples of a pixel of a tile, summed in their order.
    #[inline(always)]
    pub(super) fn sum(&self, colors: &Colors, pixel: usize) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for sample in 0..self.len() {
            let (block, lane) = self.lane(pixel, sample);
            sum = three!(channel => sum[channel] + colors[block][channel].0[lane]);
        }
        sum
    }
}

/// Room for the rays of a tile of single pixels.
pub(super) struct Gathered {
    rays: Rays,
    live: [u32; BLOCKS],
}

impl Gathered {
    pub(super) fn new() -> Self {
        Self { rays: Rays::empty(), live: [0; BLOCKS] }
    }

    /// Traces some pixels, no more than fit into a tile, all near `center`: columns and rows of the frame.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "what a band lends its tiles")]
    pub(super) fn trace<'a, S: Simd, W: Watch>(
        &mut self,
        simd: S,
        frame: &PreparedFrame,
        pattern: &Pattern,
        center: [u32; 2],
        pixels: &[[u32; 2]],
        scratch: &'a mut Scratch<'_>,
        counts: &mut RayCounts,
        watch: &mut W,
    ) -> Result<&'a Colors, Cancelled> {
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
        let tile = EyeTile::new(frame, &self.rays, self.live, center, pattern.grid);
        trace(simd, &tile, scratch, counts, watch)
    }
}
