//! Functions of sixteen lanes, made of plain operations: the same bits on every level.

use super::{Bytes, Simd, SimdBase, SimdFloat, f32x16, i32x16, select, splat, u32x16};

/// log2 of positive, normal numbers; relative error below 3e-7, also next to 1, where log2 is next to 0.
///
/// x = 2^k m with m in [sqrt(1/2), sqrt(2)); log2(m) = 2/ln 2 atanh(s), s = (m - 1) / (m + 1), as a polynomial in s^2.
#[inline(always)]
pub(crate) fn log2<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let bits: i32x16<S> = x.bitcast();
    // The bits of sqrt(1/2): subtracting them puts the boundary between powers where we want it.
    let exponent = (bits - i32x16::splat(simd, 0x3f35_04f3)) >> 23;
    let k = simd.cvt_f32_i32x16(exponent);
    let m: f32x16<S> = (bits - (exponent << 23)).bitcast();
    let one = splat(simd, 1.0);
    let s = (m - one) / (m + one);
    let s2 = s * s;
    // 2 / (ln 2 (2 i + 1))
    let series = [2.885_39, 0.961_796_7, 0.577_078, 0.412_198_6, 0.320_598_9];
    let mut sum = splat(simd, series[4]);
    for i in 0..4 {
        sum = sum * s2 + splat(simd, series[3 - i]);
    }
    k + sum * s
}

/// 2^x for x in [-126, 127]; relative error below 2e-7. Lower x give 0.
#[inline(always)]
pub(crate) fn exp2<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let whole = x.round_ties_even();
    let f = (x - whole) * splat(simd, std::f32::consts::LN_2);
    // Taylor up to f^7 / 5040 on |f| <= ln 2 / 2.
    let series = [1.0, 1.0, 0.5, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0, 1.0 / 5040.0];
    let mut sum = splat(simd, series[7]);
    for i in 0..7 {
        sum = sum * f + splat(simd, series[6 - i]);
    }
    let biased = simd.cvt_i32_f32x16(whole) + i32x16::splat(simd, 127);
    let power: f32x16<S> = (biased << 23).bitcast();
    let representable = whole.simd_gt(splat(simd, -127.0));
    sum * select(representable, power, splat(simd, 0.0))
}

/// Linear light in [0, 1] to sRGB in [0, 255], not yet rounded (IEC 61966-2-1); error below 6e-5.
///
/// x^(1 / 2.4) is smooth in the fourth root of x over the upper branch: a polynomial interpolates it there.
#[inline(always)]
pub(crate) fn srgb255<S: Simd>(simd: S, linear: f32x16<S>) -> f32x16<S> {
    let threshold = splat(simd, 0.003_130_8);
    let low = linear * splat(simd, 12.92 * 255.0);
    // Below the threshold the other branch counts.
    let x = linear.max(threshold).sqrt().sqrt() - splat(simd, 0.618);
    let series = [
        106.600_77,
        325.312_6,
        175.464_61,
        -31.581_963,
        17.057_21,
        -12.026_469,
        10.560_63,
        -18.329_702,
        20.634_646,
    ];
    let mut high = splat(simd, series[8]);
    for i in 0..8 {
        high = high * x + splat(simd, series[7 - i]);
    }
    select(linear.simd_le(threshold), low, high)
}

/// A power of two that brings these numbers into [1, 2), exactly: they are not negative, and not subnormal if anything is
/// to be made of them.
#[inline(always)]
pub(crate) fn to_unit<S: Simd>(simd: S, size: f32x16<S>) -> f32x16<S> {
    let exponent = size.bitcast::<u32x16<S>>() & u32x16::splat(simd, 0x7f80_0000);
    (u32x16::splat(simd, 254 << 23) - exponent).bitcast()
}

#[cfg(test)]
mod tests {
    use super::super::{LANES, all, dispatch};
    use super::*;

    #[inline(always)]
    fn apply<S: Simd>(simd: S, x: [f32; LANES], which: u8) -> [f32; LANES] {
        let x = f32x16::load_array(simd, x);
        match which {
            0 => log2(simd, x),
            1 => exp2(simd, x),
            _ => srgb255(simd, x),
        }
        .to_array()
    }

    fn sixteen(from: f32, to: f32, step: u32) -> [f32; LANES] {
        std::array::from_fn(|i| from + (to - from) * ((step * 16 + i as u32) as f32 / 16_000.0))
    }

    #[test]
    fn they_are_accurate_and_the_same_on_every_level() {
        let exact = [libm::log2, libm::exp2, srgb];
        for (which, from, to, tolerance) in [
            (0, 0.5, 2.0, 3e-7),
            (0, 1e-30, 1e3, 3e-7),
            (0, 0.999, 1.001, 4e-7),
            (1, -125.0, 20.0, 2e-7),
            (2, 0.0, 1.0, 6e-5),
            (2, 0.0, 0.02, 6e-5),
        ] {
            for step in 0..1000 {
                let x = sixteen(from, to, step);
                let first = dispatch!(all()[0], simd => apply(simd, x, which));
                for level in all() {
                    let here = dispatch!(level, simd => apply(simd, x, which));
                    assert_eq!(here.map(f32::to_bits), first.map(f32::to_bits), "{which} at {x:?}");
                }
                for (x, y) in x.into_iter().zip(first) {
                    let expected = exact[usize::from(which)](f64::from(x));
                    let error = (f64::from(y) - expected).abs();
                    let allowed = if which == 2 { tolerance } else { tolerance * expected.abs() + 1e-12 };
                    assert!(error <= allowed, "{which}({x}) = {y}, not {expected}");
                }
            }
        }
    }

    fn srgb(x: f64) -> f64 {
        255.0 * if x <= 0.0031308 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 }
    }
}
