//! Adaptive sampling: the samples of a cell of 4 x 4 pixels end when the estimate of its error is small enough.
//!
//! With e the mean of red, green and blue, added, over the samples of a pixel with an even number, o that over the others, and m that over
//! all of them, the error of a pixel after n samples, n even, is estimated as
//!
//! ```text
//! r = |e - o| / 2 / max(m, 3/64)
//! ```
//!
//! For independent samples of variance v, (e - o) / 2 has the variance v / n, as m has. The estimate of one pixel has one degree of
//! freedom and is often far too small, so pixels end together with those of their cell: where the root of the mean square of r over the
//! cell is at most `max_noise`, and the largest r at most twice that. Cells are aligned to the picture, and a cell of which a segment has
//! some rows is traced whole, so a pixel still depends on the scene, the view and its place alone.
//!
//! Samples that are spread evenly, as those of the Sobol sequence, are closer to the truth than this estimate says.
//!
//! Cells end at fixed checkpoints: after 64, 128, 256, ... samples. The choice depends on the samples that are kept, which is a bias: a
//! cell that misses rare bright paths in its first samples has a small estimate, ends early, and stays too dark. Dark pixels have an
//! absolute limit: `max_noise` / 64 of white.

#[cfg(test)]
mod tests;

use std::ops::Range;

use crate::film::{PixelSums, TilePixels};
use crate::rays::{BLOCKS, place};
use crate::scene::{FrameView, PathSettings};
use crate::simd::each_bit;

/// Samples of a pixel at the first checkpoint. Each checkpoint has twice the samples of the previous one.
pub(super) const FIRST_CHECKPOINT: u32 = 64;

/// Rows and columns of a cell: those of a block of a tile.
const CELL: u32 = 4;

/// Least mean of a pixel, red, green and blue added, to which its error is related: 1/64 of white.
const LEAST_MEAN: f64 = 3.0 / 64.0;

/// Largest error of a pixel, in parts of the limit for its cell.
const LARGEST: f64 = 2.0;

/// Steps of a sum per unit of radiance: see [`PixelSums`].
const STEPS: f64 = (1 << 20) as f64;

/// Numbers of samples of the pixels of a band, and the error at which they end.
pub(super) struct NoiseLimit {
    max_noise: f64,
    width: usize,
    /// Samples of each pixel of the traced rows.
    pub counts: Vec<u32>,
}

impl NoiseLimit {
    /// The limit of a view, for traced rows of its picture; `None` if all pixels have all samples.
    pub(super) fn of(view: &FrameView, settings: &PathSettings, traced: &Range<u32>) -> Option<Self> {
        let width = view.width as usize;
        (settings.max_noise > 0.0).then(|| Self {
            max_noise: f64::from(settings.max_noise),
            width,
            counts: vec![view.samples; width * traced.len()],
        })
    }

    /// Ends the cells of a tile whose error after a number of samples is small enough: removes them from the live blocks. Does nothing
    /// between checkpoints. `sums` are those of the traced rows, which are `pixels.rows`.
    #[inline(never)]
    pub(super) fn end_cells(
        &mut self,
        samples: u32,
        pixels: &TilePixels,
        sums: &[PixelSums],
        live: &mut [u32; BLOCKS],
    ) {
        if samples < FIRST_CHECKPOINT || !samples.is_power_of_two() {
            return;
        }
        for (block, live) in live.iter_mut().enumerate() {
            let index = |lane| {
                let (column, row) = place(block, lane);
                let row = pixels.top as usize + row - pixels.rows.start as usize;
                row * self.width + pixels.left as usize + column
            };
            let errors = each_bit(*live).map(|lane| error(&sums[index(lane)], samples));
            if *live != 0 && self.is_reached(errors) {
                each_bit(*live).for_each(|lane| self.counts[index(lane)] = samples);
                *live = 0;
            }
        }
    }

    /// Whether pixels with these errors, those of a cell, have enough samples.
    fn is_reached(&self, errors: impl Iterator<Item = f64>) -> bool {
        let (mut squares, mut largest, mut count) = (0.0, 0.0_f64, 0.0);
        for error in errors {
            squares += error * error;
            largest = largest.max(error);
            count += 1.0;
        }
        squares <= count * self.max_noise * self.max_noise && largest <= LARGEST * self.max_noise
    }
}

/// The rows of all cells that have some of these rows, in a picture of `height` rows.
pub(super) fn rows_of_cells(rows: &Range<u32>, height: u32) -> Range<u32> {
    rows.start / CELL * CELL..rows.end.next_multiple_of(CELL).min(height)
}

/// The estimated relative error r of a pixel after an even number of samples.
fn error(sums: &PixelSums, samples: u32) -> f64 {
    let samples = f64::from(samples) * STEPS;
    let all = sums.rgb.iter().map(|sum| *sum as f64).sum::<f64>();
    let even = sums.even as f64;
    // Halves have n / 2 samples: half the difference of their means is the difference of their sums over n.
    (even - (all - even)).abs() / samples / (all / samples).max(LEAST_MEAN)
}
