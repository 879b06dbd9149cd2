//! From linear light to the bytes of pixels, in every format, with every tone curve.

use std::ops::Range;

use super::encode::write_each;
use super::tone::Tone;
use super::{Dither, PixelSums};
use crate::frame::PreparedFrame;
use crate::scene::{ColorDepth, FrameView, PixelFormat, ToneMapping};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Level, Simd, dispatch};
use crate::srgb::{self, Encoded};

/// Bytes of a pixel of linear light.
const LINEAR: usize = PixelFormat::Linear.bytes_per_pixel();

/// Bytes of a pixel's sums.
const SUMS: usize = PixelFormat::Sums.bytes_per_pixel();

/// Conversion of linear light to the pixels of some rows, sixteen pixels at a time.
#[derive(Clone, Copy)]
pub(crate) struct Development {
    level: Level,
    format: PixelFormat,
    tone: Tone,
    dither: Option<Dither>,
}

impl Development {
    /// The conversion for these rows of a frame; `None` for the plain one: RGB8 of light as it is, without dither.
    pub(crate) fn of(frame: &PreparedFrame, rows: &Range<u32>) -> Option<Self> {
        let view = frame.view();
        let dithered = view.quality.dither && view.quality.colors == ColorDepth::Exact;
        let plain = view.format == PixelFormat::Rgb8 && view.tone == ToneMapping::default() && !dithered;
        (!plain).then(|| Self::new(frame.level, view, rows.start))
    }

    /// The conversion for the rows from `first_row` on, plain or not.
    #[cold]
    pub(super) fn new(level: Level, view: &FrameView, first_row: u32) -> Self {
        let dither = Dither::of(view, first_row);
        Self { level, format: view.format, tone: Tone::new(view.tone), dither }
    }

    /// Writes up to sixteen pixels; `indices` are theirs among those of the rows. The integrators that use lanes of light have no
    /// sums, so [`PixelFormat::Sums`] writes nothing.
    #[inline(never)]
    pub(super) fn write(&self, light: &[Lanes; 3], indices: &[usize], out: &mut [u8]) {
        match self.format {
            PixelFormat::Rgb8 => {
                write_each(&dispatch!(self.level, simd => self.rgb8(simd, light, indices)), indices, out);
            }
            PixelFormat::Linear => {
                for (lane, index) in indices.iter().enumerate() {
                    let pixel = [0, 1, 2].map(|channel| number(light[channel].0[lane]).to_le_bytes());
                    out[LINEAR * index..LINEAR * (index + 1)].copy_from_slice(pixel.as_flattened());
                }
            }
            PixelFormat::Sums => {}
        }
    }

    #[inline(always)]
    fn rgb8<S: Simd>(&self, simd: S, light: &[Lanes; 3], indices: &[usize]) -> Encoded {
        let display = self.tone.apply(simd, Vec3x16::load(simd, light));
        let offsets = self.dither.map(|dither| dither.offsets(indices));
        srgb::encode_lanes(simd, display, offsets.as_ref())
    }

    /// Writes the pixels that sums of a number of samples show.
    pub(super) fn write_sums(&self, samples: u32, sums: &[PixelSums], out: &mut [u8]) {
        if self.format == PixelFormat::Sums {
            let pixels = out.as_chunks_mut::<SUMS>().0;
            pixels.iter_mut().zip(sums).for_each(|(pixel, sums)| *pixel = sums.to_bytes());
            return;
        }
        self.write_light(sums.iter().map(|sums| sums.mean(samples)), out);
    }

    /// Writes pixels that show light, linear RGB; nothing in [`PixelFormat::Sums`]. What is too much on either side is ignored.
    pub(super) fn write_light(&self, pixels: impl Iterator<Item = [f32; 3]>, out: &mut [u8]) {
        let mut pixels = pixels.take(out.len() / self.format.bytes_per_pixel()).enumerate().peekable();
        while pixels.peek().is_some() {
            let (mut light, mut indices, mut count) = ([Lanes::ZERO; 3], [0; LANES], 0);
            for (index, pixel) in pixels.by_ref().take(LANES) {
                for channel in 0..3 {
                    light[channel].0[count] = pixel[channel];
                }
                indices[count] = index;
                count += 1;
            }
            self.write(&light, &indices[..count], out);
        }
    }
}

/// The number itself; 0 for NaN, whose bits differ between processors.
fn number(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value }
}

#[cfg(test)]
mod tests;
