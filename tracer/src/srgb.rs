//! Linear light to 8-bit sRGB (IEC 61966-2-1): [`encode`] one colour, exactly rounded; `encode_lanes` sixteen colours at
//! once by a polynomial, exact but within 10^-4 of a step of a threshold. Pictures take the
//! second, the oracle and its tests the first.
//!
//! 255 thresholds, computed once in `f64`, say where one code ends and the next begins. A table over the leading bits
//! of the number finds the first candidate; a comparison or two does the rest. No libm in the per-pixel path, so all
//! machines agree.

use std::sync::LazyLock;

use glam::Vec3;

use crate::simd::math::srgb255;
use crate::simd::vector::Vec3x16;
use crate::simd::{Bytes, Lanes, Simd, SimdBase, SimdFloat, f32x16, select, splat, three, u8x64};

/// Bits of an `f32` below those that index the table: 8 bits of exponent and 6 of mantissa stay.
const SHIFT: u32 = 17;

/// The table ends at the number 1.0.
const ONE_INDEX: usize = (1.0_f32.to_bits() >> SHIFT) as usize;

struct Encoder {
    /// `thresholds[i]`: the least number that encodes to i + 1.
    thresholds: [f32; 255],
    /// Code of the least number of each bucket.
    first_code: [u8; ONE_INDEX + 1],
}

static ENCODER: LazyLock<Encoder> = LazyLock::new(Encoder::new);

/// Encodes a linear colour; values outside [0, 1] are clamped, NaN becomes 0.
#[inline]
pub fn encode(color: Vec3) -> [u8; 3] {
    let encoder = &*ENCODER;
    color.to_array().map(|linear| encoder.encode(linear))
}

/// RGB8 of four rows of four pixels: row i in the twelve bytes from 16 i on.
pub(crate) type Encoded = [u8; 64];

/// Encodes sixteen linear colours; values outside [0, 1] are clamped, NaN becomes 0. By a polynomial: a value within 10^-4
/// of a step of a threshold may fall on its other side. `offsets` in steps, less than half of one, are added before a value
/// is rounded.
#[inline(always)]
pub(crate) fn encode_lanes<S: Simd>(simd: S, color: Vec3x16<S>, offsets: Option<&Lanes>) -> Encoded {
    let mut steps = three!(channel => unrounded(simd, color.0[channel]));
    if let Some(offsets) = offsets {
        let offsets = offsets.load(simd);
        steps = three!(channel => (steps[channel] + offsets).max(splat(simd, 0.0)));
    }
    let [r, g, b] = three!(channel => simd.cvt_u32_f32x16(steps[channel].round_ties_even()));
    let pixels = r | (g << 8) | (b << 16);
    let without_fourth = u8x64::load_array_ref(simd, &WITHOUT_FOURTH);
    simd.swizzle_dyn_within_blocks_u8x64(pixels.to_bytes(), without_fourth).to_array()
}

/// In each sixteen bytes: four times three of four.
const WITHOUT_FOURTH: [u8; 64] = {
    let mut from = [0; 64];
    let mut to = 0;
    while to < 64 {
        let place = to % 16;
        from[to] = if place < 12 { (place / 3 * 4 + place % 3) as u8 } else { 15 };
        to += 1;
    }
    from
};

/// What [`encode_lanes`] rounds: in steps of the encoding, from 0 to 255.
#[inline(always)]
pub(crate) fn unrounded<S: Simd>(simd: S, linear: f32x16<S>) -> f32x16<S> {
    let zero = splat(simd, 0.0);
    // False for NaN.
    let positive = select(linear.simd_gt(zero), linear, zero);
    srgb255(simd, positive.min(splat(simd, 1.0)))
}

/// The linear values of all 8-bit sRGB codes: textures are made of them.
pub(crate) fn decoded() -> &'static [f32; 256] {
    static DECODED: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|code| decode(code as u8) as f32));
    &DECODED
}

/// The linear value, 0..1, of an 8-bit sRGB code.
pub fn decode(code: u8) -> f64 {
    decode_unit(f64::from(code) / 255.0)
}

fn decode_unit(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

impl Encoder {
    fn new() -> Self {
        let thresholds = std::array::from_fn(|i| {
            let exact = decode_unit((i as f64 + 0.5) / 255.0);
            let rounded = exact as f32;
            if f64::from(rounded) < exact { rounded.next_up() } else { rounded }
        });
        let first_code = std::array::from_fn(|bucket| {
            let least = f32::from_bits((bucket as u32) << SHIFT);
            thresholds.partition_point(|&threshold| threshold <= least) as u8
        });
        Self { thresholds, first_code }
    }

    #[inline]
    fn encode(&self, linear: f32) -> u8 {
        if linear >= 1.0 {
            return 255;
        }
        // False for NaN too.
        if !(linear > 0.0) {
            return 0;
        }
        let mut code = self.first_code[(linear.to_bits() >> SHIFT) as usize];
        while code < 255 && linear >= self.thresholds[code as usize] {
            code += 1;
        }
        code
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by_formula(linear: f64) -> f64 {
        let encoded =
            if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 };
        encoded * 255.0
    }

    #[test]
    fn every_code_comes_back() {
        for code in 0..=255 {
            assert_eq!(encode(Vec3::splat(decode(code) as f32)), [code; 3]);
        }
    }

    #[test]
    fn it_rounds_as_the_formula_does() {
        for i in 0..200_000 {
            let linear = i as f32 / 199_999.0;
            let exact = by_formula(f64::from(linear));
            let code = f64::from(encode(Vec3::splat(linear))[0]);
            // The two branches of the standard meet only to 1e-8 or so: allow that at the boundary.
            assert!((code - exact).abs() <= 0.5 + 1e-4, "{linear}: {code} but {exact}");
        }
    }

    #[test]
    fn what_is_out_of_range_is_clamped() {
        let odd = [f32::NAN, -1.0, f32::NEG_INFINITY, 1.0, 7.0, f32::INFINITY, 1e-40, 0.0];
        let codes = odd.map(|value| encode(Vec3::splat(value))[0]);
        assert_eq!(codes, [0, 0, 0, 255, 255, 255, 0, 0]);
    }
}
