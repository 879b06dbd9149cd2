//! Means of samples, encoded as bytes sixteen pixels at a time.
//!
//! The plain encoding, RGB8 of light as it is, is here, where it is compiled into the loops over tiles. All others are in
//! [`Development`], which is called for sixteen pixels at a time. The lane encoder gives four pixels in each sixteen bytes.

use std::ops::Range;

use super::{Development, PixelFormat, TilePixels};
use crate::frame::PreparedFrame;
use crate::rays::{BLOCKS, TileColors, place};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, each_bit, splat, three};
use crate::srgb::{self, Encoded};

/// Bytes of a pixel of the plain encoding.
const BYTES: usize = PixelFormat::Rgb8.bytes_per_pixel();

/// Bytes of four pixels, and the distance from four pixels to the next four in the encoder's output.
const FOUR: usize = 4 * BYTES;
const ENCODED_FOUR: usize = 16;

/// Index of a pixel among those of some rows.
#[derive(Clone, Copy)]
pub(crate) struct PixelIndex(pub usize);

impl PixelIndex {
    /// The pixel in column `x` and row `y` of the frame.
    pub(crate) fn of(frame: &PreparedFrame, rows: &Range<u32>, x: u32, y: u32) -> Self {
        Self((y - rows.start) as usize * frame.width() as usize + x as usize)
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
    if let Some(development) = Development::of(frame, &pixels.rows) {
        return develop_samples(&development, frame, pixels, colors, live, out);
    }
    for block in 0..BLOCKS {
        if live[block] == 0 {
            continue;
        }
        let encoded = srgb::encode_lanes(simd, Vec3x16::load(simd, &colors[block]), None);
        for row_of_block in 0..4 {
            let (first, encoded) = (row_of_block * 4, &encoded[row_of_block * ENCODED_FOUR..][..FOUR]);
            let (column, row) = place(block, first);
            let (x, y) = (pixels.left + column as u32, pixels.top + row as u32);
            match live[block] >> first & 0xf {
                0 => {}
                0xf => {
                    let at = BYTES * PixelIndex::of(frame, &pixels.rows, x, y).0;
                    out[at..at + FOUR].copy_from_slice(encoded);
                }
                some => {
                    for lane in each_bit(some) {
                        let at = BYTES * PixelIndex::of(frame, &pixels.rows, x + lane as u32, y).0;
                        out[at..at + BYTES].copy_from_slice(&encoded[BYTES * lane..BYTES * lane + BYTES]);
                    }
                }
            }
        }
    }
}

/// The same for other encodings than the plain one.
#[inline(never)]
fn develop_samples(
    development: &Development,
    frame: &PreparedFrame,
    pixels: &TilePixels,
    colors: &TileColors,
    live: &[u32; BLOCKS],
    out: &mut [u8],
) {
    for block in 0..BLOCKS {
        let mut light = [Lanes::ZERO; 3];
        let mut indices = [0; LANES];
        let mut count = 0;
        for lane in each_bit(live[block]) {
            let (column, row) = place(block, lane);
            let (x, y) = (pixels.left + column as u32, pixels.top + row as u32);
            PixelIndex(indices[count]) = PixelIndex::of(frame, &pixels.rows, x, y);
            for channel in 0..3 {
                light[channel].0[count] = colors[block][channel].0[lane];
            }
            count += 1;
        }
        development.write(&light, &indices[..count], out);
    }
}

/// Encoder of means in linear light, which collects sixteen pixels at a time.
pub(crate) struct Means {
    /// Divisor of the sums.
    weight: f32,
    /// Encoding other than the plain one.
    development: Option<Development>,
    sums: [Lanes; 3],
    indices: [usize; LANES],
    count: usize,
}

impl Means {
    /// Means of sums with a total weight, for the bytes of these rows.
    pub(crate) fn of(weight: f32, frame: &PreparedFrame, rows: &Range<u32>) -> Self {
        let development = Development::of(frame, rows);
        Self { weight, development, sums: [Lanes::ZERO; 3], indices: [0; LANES], count: 0 }
    }

    /// Adds a pixel, and writes sixteen when they are complete.
    #[inline(always)]
    pub(crate) fn push<S: Simd>(&mut self, simd: S, sum: [f32; 3], pixel: PixelIndex, out: &mut [u8]) {
        for channel in 0..3 {
            self.sums[channel].0[self.count] = sum[channel];
        }
        self.indices[self.count] = pixel.0;
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
        let means = Vec3x16(three!(channel => sums.0[channel] / weight));
        let count = std::mem::take(&mut self.count);
        let indices = &self.indices[..count];
        match &self.development {
            None => write_each(&srgb::encode_lanes(simd, means, None), indices, out),
            Some(development) => {
                let mut light = [Lanes::ZERO; 3];
                means.store(&mut light);
                development.write(&light, indices, out);
            }
        }
    }
}

/// Writes encoded pixels to their places.
#[inline(always)]
pub(super) fn write_each(encoded: &Encoded, indices: &[usize], out: &mut [u8]) {
    for (pixel, &index) in indices.iter().enumerate() {
        let (at, from) = (BYTES * index, pixel / 4 * ENCODED_FOUR + pixel % 4 * BYTES);
        out[at..at + BYTES].copy_from_slice(&encoded[from..from + BYTES]);
    }
}

/// Writes the means of the corners of up to sixteen pixels of a row, the first `columns` of which are in the picture; `sums`
/// are of four corners each.
#[inline(always)]
pub(crate) fn write_corner_means<S: Simd>(
    simd: S,
    sums: Vec3x16<S>,
    columns: usize,
    PixelIndex(first): PixelIndex,
    development: Option<&Development>,
    out: &mut [u8],
) {
    let (columns, means) = (columns.min(LANES), sums.scale(splat(simd, 0.25)));
    if let Some(development) = development {
        let (mut light, indices) = ([Lanes::ZERO; 3], std::array::from_fn::<_, LANES, _>(|i| first + i));
        means.store(&mut light);
        return development.write(&light, &indices[..columns], out);
    }
    let encoded = srgb::encode_lanes(simd, means, None);
    let mut pixels = [0; BYTES * LANES];
    for four in 0..LANES / 4 {
        pixels[FOUR * four..FOUR * (four + 1)].copy_from_slice(&encoded[ENCODED_FOUR * four..][..FOUR]);
    }
    let (at, bytes) = (BYTES * first, BYTES * columns);
    out[at..at + bytes].copy_from_slice(&pixels[..bytes]);
}
