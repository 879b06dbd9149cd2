//! Ordered dither (Bayer, "An optimum method for two-level rendition of continuous-tone pictures", 1973): each pixel is rounded
//! with its own threshold, so that the mean of 8 x 8 pixels of a slow gradient is exact, and no bands are visible.
//!
//! Thresholds depend on a pixel's place in the whole frame only, so any cut of a frame gives the same bytes. All channels of a
//! pixel have the same threshold, so that grey stays grey. Values that are whole steps do not change.

use super::PixelFormat;
use crate::scene::{ColorDepth, FrameView};
use crate::simd::Lanes;

/// Bytes of a pixel.
const BYTES: usize = PixelFormat::Rgb8.bytes_per_pixel();

/// Pixels along a side of the pattern.
const SIDE: usize = 8;
const STEPS: f32 = (SIDE * SIDE) as f32;

/// The thresholds of some rows of a frame.
#[derive(Clone, Copy)]
pub(super) struct Dither {
    width: usize,
    first_row: usize,
}

impl Dither {
    /// The thresholds of the rows from `first_row` on; `None` if pixels are rounded, or dithered later because they have fewer
    /// colours.
    pub(super) fn of(view: &FrameView, first_row: u32) -> Option<Self> {
        let quality = view.quality;
        (quality.dither && quality.colors == ColorDepth::Exact).then(|| Self::new(view, first_row))
    }

    fn new(view: &FrameView, first_row: u32) -> Self {
        Self { width: view.width as usize, first_row: first_row as usize }
    }

    /// Terms that are added to pixels before they are rounded, in steps of the encoding; `indices` are those of the pixels among
    /// those of the rows.
    pub(super) fn offsets(&self, indices: &[usize]) -> Lanes {
        let mut offsets = Lanes::ZERO;
        for (to, pixel) in offsets.0.iter_mut().zip(indices) {
            *to = offset(pixel % self.width, self.first_row + pixel / self.width);
        }
        offsets
    }
}

/// Rounds the pixels of the rows from `first_row` on to fewer colours, by their thresholds.
pub(super) fn reduce_colors(view: &FrameView, first_row: u32, bytes: &mut [u8]) {
    let Dither { width, first_row } = Dither::new(view, first_row);
    for (index, pixel) in bytes.as_chunks_mut::<BYTES>().0.iter_mut().enumerate() {
        let offset = offset(index % width, first_row + index / width);
        let [r, g, b] = *pixel;
        *pixel = [reduced::<5>(r, offset), reduced::<6>(g, offset), reduced::<5>(b, offset)];
    }
}

/// A channel rounded to `BITS` bits, as a byte: its upper bits are repeated below.
fn reduced<const BITS: u32>(value: u8, offset: f32) -> u8 {
    let most = ((1_u32 << BITS) - 1) as f32;
    let number = (f32::from(value) * (most / 255.0) + offset).round_ties_even().clamp(0.0, most) as u32;
    (number << (8 - BITS) | number >> (2 * BITS - 8)) as u8
}

/// The threshold of a pixel: each of 64 values from -63/128 to 63/128 once in 8 x 8 pixels.
fn offset(x: usize, y: usize) -> f32 {
    (f32::from(rank(x % SIDE, y % SIDE)) + 0.5) / STEPS - 0.5
}

/// Rank of a pixel in the pattern, 0..64: bits of x ^ y and of y alternate, the lowest bits are the most significant.
fn rank(x: usize, y: usize) -> u8 {
    let mixed = x ^ y;
    let bits = (0..3).fold(0, |bits, bit| bits << 2 | (mixed >> bit & 1) << 1 | (y >> bit & 1));
    bits as u8
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn eight_by_eight_pixels_have_each_threshold_once() {
        let ranks: BTreeSet<u8> = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| rank(x, y))).collect();
        assert_eq!(ranks.into_iter().collect::<Vec<_>>(), (0..64).collect::<Vec<_>>());
        // The corner of the classic matrix.
        assert_eq!([rank(0, 0), rank(1, 0), rank(0, 1), rank(1, 1)], [0, 32, 48, 16]);
        assert_eq!(offset(3, 5), offset(3 + 8, 5 + 16));
    }

    #[test]
    fn offsets_are_even_about_zero_and_less_than_half_a_step() {
        let all: Vec<f32> = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| offset(x, y))).collect();
        assert!(all.iter().all(|offset| offset.abs() < 0.5), "whole steps stay as they are");
        assert_eq!(all.iter().sum::<f32>(), 0.0);
    }

    #[test]
    fn fewer_colours_keep_the_mean_and_both_ends() {
        for value in 0..=255_u8 {
            let mean = |shown: &dyn Fn(f32) -> u8| {
                let all = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| offset(x, y)));
                all.map(|offset| f32::from(shown(offset))).sum::<f32>() / STEPS
            };
            let five = mean(&|offset| reduced::<5>(value, offset));
            let six = mean(&|offset| reduced::<6>(value, offset));
            assert!((five - f32::from(value)).abs() < 0.75, "{value} became {five}");
            assert!((six - f32::from(value)).abs() < 0.75, "{value} became {six}");
        }
        let ends = [-0.49, 0.0, 0.49].map(|offset| [reduced::<5>(0, offset), reduced::<6>(255, offset)]);
        assert_eq!(ends, [[0, 255]; 3]);
    }
}
