//! Means of samples, as bytes.

use std::ops::Range;

use super::dither::Dither;
use super::regular::Pixels;
use crate::frame::PreparedFrame;
use crate::shade::Colors;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, each_bit, splat, three};
use crate::srgb;
use crate::tile::{BLOCKS, place};

/// Where a pixel's bytes stand in the bytes of some rows.
#[derive(Clone, Copy)]
pub(super) struct Place(pub usize);

impl Place {
    pub(super) fn of(frame: &PreparedFrame, rows: &Range<u32>, x: u32, y: u32) -> Self {
        Self(((y - rows.start) as usize * frame.width() as usize + x as usize) * 3)
    }
}

/// One sample a pixel: encoded lane by lane.
#[inline(always)]
pub(super) fn write_samples<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    pixels: &Pixels,
    colors: &Colors,
    live: &[u32; BLOCKS],
    out: &mut [u8],
) {
    let dither = Dither::of(frame, &pixels.rows);
    for block in 0..BLOCKS {
        if live[block] == 0 {
            continue;
        }
        let offsets = dither.map(|dither| dither.offsets(&places(frame, pixels, block)));
        let encoded = srgb::encode_lanes(simd, Vec3x16::load(simd, &colors[block]), offsets.as_ref());
        for row_of_block in 0..4 {
            let (first, encoded) = (row_of_block * 4, &encoded[row_of_block * 16..][..12]);
            let (column, row) = place(block, first);
            let (x, y) = (pixels.left + column as u32, pixels.top + row as u32);
            match live[block] >> first & 0xf {
                0 => {}
                0xf => {
                    let Place(at) = Place::of(frame, &pixels.rows, x, y);
                    out[at..at + 12].copy_from_slice(encoded);
                }
                some => {
                    for lane in each_bit(some) {
                        let Place(at) = Place::of(frame, &pixels.rows, x + lane as u32, y);
                        out[at..at + 3].copy_from_slice(&encoded[3 * lane..3 * lane + 3]);
                    }
                }
            }
        }
    }
}

/// Where the bytes of a block's pixels stand among those of the rows, as far as they do.
#[cold]
fn places(frame: &PreparedFrame, pixels: &Pixels, block: usize) -> [usize; LANES] {
    std::array::from_fn(|lane| {
        let (column, row) = place(block, lane);
        let (x, y) = (pixels.left as usize + column, pixels.top as usize + row);
        let row = y.saturating_sub(pixels.rows.start as usize);
        (row * frame.width() as usize + x) * 3
    })
}

/// Means of colours in linear light, encoded sixteen pixels at a time.
pub(super) struct Means {
    /// What a sum is divided by.
    weight: f32,
    dither: Option<Dither>,
    sums: [Lanes; 3],
    places: [usize; LANES],
    count: usize,
}

impl Means {
    /// Of sums that weigh so much, for the bytes of these rows.
    pub(super) fn of(weight: f32, frame: &PreparedFrame, rows: &Range<u32>) -> Self {
        let dither = Dither::of(frame, rows);
        Self { weight, dither, sums: [Lanes::ZERO; 3], places: [0; LANES], count: 0 }
    }

    /// A pixel.
    #[inline(always)]
    pub(super) fn push<S: Simd>(&mut self, simd: S, sum: [f32; 3], place: Place, out: &mut [u8]) {
        for channel in 0..3 {
            self.sums[channel].0[self.count] = sum[channel];
        }
        self.places[self.count] = place.0;
        self.count += 1;
        if self.count == LANES {
            self.finish(simd, out);
        }
    }

    /// Writes the pixels that are still to be written.
    #[inline(always)]
    pub(super) fn finish<S: Simd>(&mut self, simd: S, out: &mut [u8]) {
        let weight = splat(simd, self.weight);
        let sums = Vec3x16::load(simd, &self.sums);
        let offsets = self.dither.map(|dither| dither.offsets(&self.places));
        let means = Vec3x16(three!(channel => sums.0[channel] / weight));
        let encoded = srgb::encode_lanes(simd, means, offsets.as_ref());
        for pixel in 0..self.count {
            let (at, from) = (self.places[pixel], pixel / 4 * 16 + pixel % 4 * 3);
            out[at..at + 3].copy_from_slice(&encoded[from..from + 3]);
        }
        self.count = 0;
    }
}

/// Means of the corners of up to sixteen pixels of a row, of which `columns` stand in the picture: `sums` of four each.
#[inline(always)]
pub(super) fn write_flat<S: Simd>(
    simd: S,
    sums: Vec3x16<S>,
    columns: usize,
    Place(place): Place,
    dither: Option<Dither>,
    out: &mut [u8],
) {
    let places = || std::array::from_fn(|pixel| place + 3 * pixel);
    let offsets = dither.map(|dither| dither.offsets(&places()));
    let encoded = srgb::encode_lanes(simd, sums.scale(splat(simd, 0.25)), offsets.as_ref());
    let mut pixels = [0; 3 * LANES];
    for four in 0..LANES / 4 {
        pixels[12 * four..12 * four + 12].copy_from_slice(&encoded[16 * four..16 * four + 12]);
    }
    let bytes = 3 * columns.min(LANES);
    out[place..place + bytes].copy_from_slice(&pixels[..bytes]);
}
