//! Means of samples, encoded as bytes sixteen pixels at a time.
//!
//! All pixels are [`PixelFormat::Rgb8`] today. The lane encoder gives four pixels in each sixteen bytes.

use std::ops::Range;

use super::{Dither, PixelFormat, TilePixels};
use crate::frame::PreparedFrame;
use crate::rays::{BLOCKS, TileColors, place};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, each_bit, splat, three};
use crate::srgb;

/// Bytes of a pixel.
const BYTES: usize = PixelFormat::Rgb8.bytes_per_pixel();

/// Bytes of four pixels, and the distance from four pixels to the next four in the encoder's output.
const FOUR: usize = 4 * BYTES;
const ENCODED_FOUR: usize = 16;

/// Offset of a pixel's bytes among those of some rows.
#[derive(Clone, Copy)]
pub(crate) struct PixelBytes(pub usize);

impl PixelBytes {
    /// The pixel in column `x` and row `y` of the frame.
    pub(crate) fn of(frame: &PreparedFrame, rows: &Range<u32>, x: u32, y: u32) -> Self {
        Self(((y - rows.start) as usize * frame.width() as usize + x as usize) * BYTES)
    }
}

/// Writes the pixels of a tile with one sample a pixel.
#[inline(always)]
pub(crate) fn write_samples<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    pixels: &TilePixels,
    colors: &TileColors,
    live: &[u32; BLOCKS],
    out: &mut [u8],
) {
    let dither = Dither::of(frame, &pixels.rows);
    for block in 0..BLOCKS {
        if live[block] == 0 {
            continue;
        }
        let offsets = dither.map(|dither| dither.offsets(&offsets_of(frame, pixels, block)));
        let encoded = srgb::encode_lanes(simd, Vec3x16::load(simd, &colors[block]), offsets.as_ref());
        for row_of_block in 0..4 {
            let (first, encoded) = (row_of_block * 4, &encoded[row_of_block * ENCODED_FOUR..][..FOUR]);
            let (column, row) = place(block, first);
            let (x, y) = (pixels.left + column as u32, pixels.top + row as u32);
            match live[block] >> first & 0xf {
                0 => {}
                0xf => {
                    let PixelBytes(at) = PixelBytes::of(frame, &pixels.rows, x, y);
                    out[at..at + FOUR].copy_from_slice(encoded);
                }
                some => {
                    for lane in each_bit(some) {
                        let PixelBytes(at) = PixelBytes::of(frame, &pixels.rows, x + lane as u32, y);
                        out[at..at + BYTES].copy_from_slice(&encoded[BYTES * lane..BYTES * lane + BYTES]);
                    }
                }
            }
        }
    }
}

/// Offsets of the bytes of a block's pixels among those of the rows; those of pixels above the rows are not used.
#[cold]
fn offsets_of(frame: &PreparedFrame, pixels: &TilePixels, block: usize) -> [usize; LANES] {
    std::array::from_fn(|lane| {
        let (column, row) = place(block, lane);
        let (x, y) = (pixels.left as usize + column, pixels.top as usize + row);
        let row = y.saturating_sub(pixels.rows.start as usize);
        (row * frame.width() as usize + x) * BYTES
    })
}

/// Encoder of means in linear light, which collects sixteen pixels at a time.
pub(crate) struct Means {
    /// Divisor of the sums.
    weight: f32,
    dither: Option<Dither>,
    sums: [Lanes; 3],
    offsets: [usize; LANES],
    count: usize,
}

impl Means {
    /// Means of sums with a total weight, for the bytes of these rows.
    pub(crate) fn of(weight: f32, frame: &PreparedFrame, rows: &Range<u32>) -> Self {
        let dither = Dither::of(frame, rows);
        Self { weight, dither, sums: [Lanes::ZERO; 3], offsets: [0; LANES], count: 0 }
    }

    /// Adds a pixel, and writes sixteen when they are complete.
    #[inline(always)]
    pub(crate) fn push<S: Simd>(&mut self, simd: S, sum: [f32; 3], pixel: PixelBytes, out: &mut [u8]) {
        for channel in 0..3 {
            self.sums[channel].0[self.count] = sum[channel];
        }
        self.offsets[self.count] = pixel.0;
        self.count += 1;
        if self.count == LANES {
            self.finish(simd, out);
        }
    }

    /// Writes the remaining pixels.
    #[inline(always)]
    pub(crate) fn finish<S: Simd>(&mut self, simd: S, out: &mut [u8]) {
        let weight = splat(simd, self.weight);
        let sums = Vec3x16::load(simd, &self.sums);
        let offsets = self.dither.map(|dither| dither.offsets(&self.offsets));
        let means = Vec3x16(three!(channel => sums.0[channel] / weight));
        let encoded = srgb::encode_lanes(simd, means, offsets.as_ref());
        for pixel in 0..self.count {
            let (at, from) = (self.offsets[pixel], pixel / 4 * ENCODED_FOUR + pixel % 4 * BYTES);
            out[at..at + BYTES].copy_from_slice(&encoded[from..from + BYTES]);
        }
        self.count = 0;
    }
}

/// Writes the means of the corners of up to sixteen pixels of a row, the first `columns` of which are in the picture; `sums`
/// are of four corners each.
#[inline(always)]
pub(crate) fn write_corner_means<S: Simd>(
    simd: S,
    sums: Vec3x16<S>,
    columns: usize,
    PixelBytes(first): PixelBytes,
    dither: Option<Dither>,
    out: &mut [u8],
) {
    let offsets = || std::array::from_fn(|pixel| first + BYTES * pixel);
    let offsets = dither.map(|dither| dither.offsets(&offsets()));
    let encoded = srgb::encode_lanes(simd, sums.scale(splat(simd, 0.25)), offsets.as_ref());
    let mut pixels = [0; BYTES * LANES];
    for four in 0..LANES / 4 {
        pixels[FOUR * four..FOUR * (four + 1)].copy_from_slice(&encoded[ENCODED_FOUR * four..][..FOUR]);
    }
    let bytes = BYTES * columns.min(LANES);
    out[first..first + bytes].copy_from_slice(&pixels[..bytes]);
}
