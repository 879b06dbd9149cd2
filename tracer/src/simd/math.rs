//! Elementary functions of sixteen lanes, of plain operations: the same bits on every level.

use super::{Bytes, Simd, SimdBase, SimdFloat, f32x16, i32x16, select, splat, u8x64, u32x16};

/// log2 of positive, normal numbers; relative error below 3e-7, also next to 1, where log2 is next to 0.
///
/// x = 2^k m with m in [sqrt(1/2), sqrt(2)); log2(m) = 2/ln 2 atanh(s), s = (m - 1) / (m + 1), as a polynomial in s^2.
#[inline(always)]
pub(crate) fn log2<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let bits: i32x16<S> = x.bitcast();
    // Subtracting the bits of sqrt(1/2) moves the boundary between powers there.
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

/// 2^x for x in [-126, 127], relative error below 2e-7; 0 for lower x.
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

/// Linear light in [0, 1] to sRGB in [0, 255], not yet rounded (IEC 61966-2-1); error below 1.5e-4.
///
/// x^(1 / 2.4) of x = 2^k m is 2^(k / 2.4), looked up in a table, times a polynomial in m.
#[inline(always)]
pub(crate) fn srgb255<S: Simd>(simd: S, linear: f32x16<S>) -> f32x16<S> {
    let threshold = splat(simd, 0.003_130_8);
    let low = linear * splat(simd, 12.92 * 255.0);
    // Clamped: below the threshold the linear branch is selected.
    let bits: u32x16<S> = linear.max(threshold).bitcast();
    let m = (bits & u32x16::splat(simd, 0x007f_ffff)) | u32x16::splat(simd, 0x3f80_0000);
    let m = m.bitcast::<f32x16<S>>() - splat(simd, 1.5);
    let series = [
        1.184_053_7,
        0.328_906_27,
        -0.063_956_715,
        0.022_423_48,
        -0.009_625_546,
        0.005_237_355_4,
        -0.002_744_525_2,
    ];
    let mut root = splat(simd, series[6]);
    for i in 0..6 {
        root = root * m + splat(simd, series[5 - i]);
    }
    let high = root * power_of_root(simd, bits) - splat(simd, 0.055 * 255.0);
    select(linear.simd_le(threshold), low, high)
}

/// 1.055 * 255 * 2^(k / 2.4) for numbers with exponent k in [-15, 0], given as bits.
#[inline(always)]
fn power_of_root<S: Simd>(simd: S, bits: u32x16<S>) -> f32x16<S> {
    // Indexed by the exponent's last four bits: k + 15.
    const POWERS: [f32; 16] = [
        3.534_721_1,
        4.718_287,
        6.298_157,
        8.407_031,
        11.222_04,
        14.979_627,
        19.995_403,
        26.690_66,
        35.627_758,
        47.557_35,
        63.481_445,
        84.737_564,
        113.111_07,
        150.985_18,
        201.541_03,
        269.025,
    ];
    // Four times the index in each byte, then the positions of the four bytes.
    const SPREAD: [u8; 64] = {
        let mut spread = [0; 64];
        let mut byte = 0;
        while byte < 64 {
            spread[byte] = (byte % 16 / 4 * 4) as u8;
            byte += 1;
        }
        spread
    };
    let place = (bits >> 21) & u32x16::splat(simd, 0x3c);
    let places = simd.swizzle_dyn_within_blocks_u8x64(place.to_bytes(), u8x64::load_array_ref(simd, &SPREAD));
    let bytes: u8x64<S> = u32x16::splat(simd, u32::from_le_bytes([0, 1, 2, 3])).to_bytes();
    f32x16::load_array_ref(simd, &POWERS).swizzle_dyn(places + bytes)
}

/// The angle of the vector (x, y) from the x axis, in radians, within [-pi, pi]; error below 4e-7. 0 for the vector of length zero.
/// Signs of zeros do not count.
///
/// atan(a) of a = min(|x|, |y|) / max(|x|, |y|) as an odd polynomial in a, off by at most 3.8e-8 on [0, 1], then moved to the octant.
#[inline(always)]
pub(crate) fn atan2<S: Simd>(simd: S, y: f32x16<S>, x: f32x16<S>) -> f32x16<S> {
    let zero = splat(simd, 0.0);
    let (rise, run) = (y.abs(), x.abs());
    let steep = rise.simd_gt(run);
    let (longer, shorter) = (select(steep, rise, run), select(steep, run, rise));
    let a = shorter / select(longer.simd_gt(zero), longer, splat(simd, 1.0));
    let a2 = a * a;
    let series = [
        0.999_999_34,
        -0.333_298_6,
        0.199_465_66,
        -0.139_086_32,
        0.096_422_03,
        -0.055_912_4,
        0.021_863_01,
        -0.004_054_581_3,
    ];
    let mut sum = splat(simd, series[7]);
    for i in 0..7 {
        sum = sum * a2 + splat(simd, series[6 - i]);
    }
    let angle = sum * a;
    let angle = select(steep, splat(simd, std::f32::consts::FRAC_PI_2) - angle, angle);
    let angle = select(x.simd_lt(zero), splat(simd, std::f32::consts::PI) - angle, angle);
    select(y.simd_lt(zero), -angle, angle)
}

/// c_0 + c_1 x + c_2 x^2 + c_3 x^3.
#[inline(always)]
fn series<S: Simd>(simd: S, x: f32x16<S>, coefficients: [f32; 4]) -> f32x16<S> {
    let mut sum = splat(simd, coefficients[3]);
    for i in 0..3 {
        sum = sum * x + splat(simd, coefficients[2 - i]);
    }
    sum
}

/// Sine and cosine of angles of at most 8 pi, in radians; error below 2e-7.
///
/// The angle is reduced to [-pi / 4, pi / 4] by the nearest multiple of pi / 2, which is subtracted in three parts (Cody and Waite), and the
/// series of sine and cosine are exchanged by its quadrant.
#[inline(always)]
pub(crate) fn sin_cos<S: Simd>(simd: S, angle: f32x16<S>) -> [f32x16<S>; 2] {
    let quadrant = (angle * splat(simd, std::f32::consts::FRAC_2_PI)).round_ties_even();
    // The parts of pi / 2: products with the quadrant are exact for the first two.
    let r = angle - quadrant * splat(simd, 1.570_312_5);
    let r = r - quadrant * splat(simd, 4.837_513e-4);
    let r = r - quadrant * splat(simd, 7.549_789_4e-8);
    let r2 = r * r;
    let one = splat(simd, 1.0);
    let of_sine = series(simd, r2, [-1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0]);
    let of_cosine = series(simd, r2, [-0.5, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0]);
    let (sine, cosine) = (r + r * r2 * of_sine, one + r2 * of_cosine);
    let turns = simd.cvt_i32_f32x16(quadrant);
    let (first, second) = (i32x16::splat(simd, 1), i32x16::splat(simd, 2));
    let odd = (turns & first).simd_eq(first);
    let sine_is_negative = (turns & second).simd_eq(second);
    let cosine_is_negative = ((turns + first) & second).simd_eq(second);
    let (sin, cos) = (select(odd, cosine, sine), select(odd, sine, cosine));
    [select(sine_is_negative, -sin, sin), select(cosine_is_negative, -cos, cos)]
}

/// The power of two that scales each number into [1, 2), exactly. Numbers must not be negative; the result is unusable for
/// subnormal ones.
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
    fn functions_are_accurate_and_equal_on_every_level() {
        let exact = [libm::log2, libm::exp2, srgb];
        for (which, from, to, tolerance) in [
            (0, 0.5, 2.0, 3e-7),
            (0, 1e-30, 1e3, 3e-7),
            (0, 0.999, 1.001, 4e-7),
            (1, -125.0, 20.0, 2e-7),
            (2, 0.0, 1.0, 1.5e-4),
            (2, 0.0, 0.02, 1.5e-4),
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

    #[inline(always)]
    fn circle<S: Simd>(simd: S, x: [f32; LANES]) -> [[f32; LANES]; 2] {
        sin_cos(simd, f32x16::load_array(simd, x)).map(|numbers| numbers.to_array())
    }

    #[test]
    fn sines_are_accurate_and_equal_on_every_level() {
        for step in 0..1000 {
            let x = sixteen(-25.0, 25.0, step);
            let first = dispatch!(all()[0], simd => circle(simd, x));
            for level in all() {
                let here = dispatch!(level, simd => circle(simd, x));
                assert_eq!(here.map(|row| row.map(f32::to_bits)), first.map(|row| row.map(f32::to_bits)));
            }
            for lane in 0..LANES {
                let (sin, cos) = (libm::sin(f64::from(x[lane])), libm::cos(f64::from(x[lane])));
                let errors = [f64::from(first[0][lane]) - sin, f64::from(first[1][lane]) - cos];
                assert!(errors.iter().all(|error| error.abs() < 2e-7), "{}: {errors:?}", x[lane]);
            }
        }
    }

    #[inline(always)]
    fn angles<S: Simd>(simd: S, y: [f32; LANES], x: [f32; LANES]) -> [f32; LANES] {
        atan2(simd, f32x16::load_array(simd, y), f32x16::load_array(simd, x)).to_array()
    }

    fn assert_angles(y: [f32; LANES], x: [f32; LANES]) {
        let first = dispatch!(all()[0], simd => angles(simd, y, x));
        for level in all() {
            let here = dispatch!(level, simd => angles(simd, y, x));
            assert_eq!(here.map(f32::to_bits), first.map(f32::to_bits), "{y:?} {x:?}");
        }
        for ((y, x), angle) in y.into_iter().zip(x).zip(first) {
            let expected = libm::atan2(f64::from(y), f64::from(x));
            let error = (f64::from(angle) - expected).abs();
            // The other end of the turn on the negative x axis, where y is a zero of either sign.
            let turned = (std::f64::consts::TAU - error).abs();
            let undefined = x == 0.0 && y == 0.0;
            assert!(undefined || error.min(turned) <= 4e-7, "atan2({y}, {x}) = {angle}, not {expected}");
        }
    }

    #[test]
    fn angles_are_accurate_and_equal_on_every_level() {
        let turn = std::f64::consts::TAU;
        for (length, step) in (0..2000).flat_map(|step| [(1.0, step), (3e-30, step), (1e30, step)]) {
            let at = |i: usize| (f64::from(step) + i as f64 / 16.0) * turn / 2000.0;
            let y = std::array::from_fn(|i| (libm::sin(at(i)) * length) as f32);
            let x = std::array::from_fn(|i| (libm::cos(at(i)) * length) as f32);
            assert_angles(y, x);
        }
        let odd = [0.0, -0.0, 1.0, -1.0, 1e-40, -1e-40, 1e30, -1e30];
        for x in odd {
            assert_angles(std::array::from_fn(|i| odd[i % 8]), [x; LANES]);
        }
        assert_eq!(dispatch!(all()[0], simd => angles(simd, [0.0; LANES], [-0.0; LANES])), [0.0; LANES]);
    }

    fn srgb(x: f64) -> f64 {
        255.0 * if x <= 0.0031308 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 }
    }
}
