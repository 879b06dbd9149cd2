//! Blinn-Phong: the highlight (N.H)^p with the half vector H (Blinn, "Models of light reflection for computer synthesized
//! pictures", 1977).

use super::binomial;
use crate::scene::{ExponentPrecision, is_squared};
use crate::simd::math::{exp2, log2};
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, SimdFloat, bits, each_bit, f32x16, mask_of, select, splat};
use crate::surface::Materials;

/// Reflectance times N.L: c_d N.L + c_s (N.H)^p, sixteen points at a time. The highlight is skipped without `to_viewer`, and in
/// blocks without a specular colour.
#[inline(always)]
pub(crate) fn eval<S: Simd>(
    simd: S,
    materials: &Materials<S>,
    normals: Vec3x16<S>,
    (to_light, n_dot_l): (Vec3x16<S>, f32x16<S>),
    to_viewer: Option<&[Lanes; 3]>,
    precision: ExponentPrecision,
) -> Vec3x16<S> {
    let diffuse = materials.diffuse.scale(n_dot_l);
    let (Some(to_viewer), true) = (to_viewer, materials.any_specular) else { return diffuse };
    let to_viewer = Vec3x16::load(simd, to_viewer);
    let highlight = highlight(simd, normals, to_light, to_viewer, materials.exponent, precision);
    diffuse.add(materials.specular.scale(highlight))
}

/// Largest exponent for which the rounding of N.H to `f32` stays below a fifth of a step of the 8-bit picture.
const SINGLE: f32 = 2000.0;

/// max(0, N.H)^p with H = (L + V) / |L + V|, in single precision where that is precise, else in double precision. The fast
/// variant is in single precision always, by a series where that is shorter; its error is at most 0.0021.
#[inline(always)]
fn highlight<S: Simd>(
    simd: S,
    normals: Vec3x16<S>,
    to_light: Vec3x16<S>,
    to_viewer: Vec3x16<S>,
    exponents: f32x16<S>,
    precision: ExponentPrecision,
) -> f32x16<S> {
    let half = to_light.add(to_viewer);
    let along = normals.dot(half);
    // (N.H)^2 needs no square root, and most exponents are even.
    let square = along * along / half.dot(half);
    let positive = along.simd_gt(splat(simd, 0.0)) & square.simd_gt(splat(simd, 1e-30));
    let square = select(positive, square, splat(simd, 1.0)).min(splat(simd, 1.0));
    let (sine_square, largest) = match precision {
        ExponentPrecision::Exact => (None, SINGLE),
        ExponentPrecision::Fast => (Some(sine_square(simd, normals, half, square, exponents)), f32::MAX),
    };
    let power = raised(simd, square, sine_square, exponents);
    let power = select(positive, power, splat(simd, 0.0));
    let odd = bits(exponents.simd_gt(splat(simd, largest)) | exponents.simd_eq(splat(simd, 0.0)));
    if odd == 0 {
        return power;
    }
    let (mut power, exponents) = (power.to_array(), exponents.to_array());
    // Lane by lane: the value of a point must not depend on the other points of its block.
    for lane in each_bit(odd) {
        power[lane] = precise(normals, to_light, to_viewer, lane, exponents[lane]);
    }
    f32x16::load_array(simd, power)
}

/// 1 - (N.H)^2. Large exponents multiply its error, so for those it is |N x H|^2, which stays precise near zero.
#[inline(always)]
fn sine_square<S: Simd>(
    simd: S,
    normals: Vec3x16<S>,
    half: Vec3x16<S>,
    square: f32x16<S>,
    exponents: f32x16<S>,
) -> f32x16<S> {
    let difference = splat(simd, 1.0) - square;
    let large = exponents.simd_gt(splat(simd, SINGLE));
    if bits(large) == 0 {
        return difference;
    }
    let cross = normals.cross(half);
    select(large, cross.dot(cross) / half.dot(half), difference)
}

/// sqrt(square)^exponent in each lane, exponent by exponent: most blocks have only one. `square` is in (0, 1]. With
/// `sine_square`, which is 1 - `square`, the error is at most 0.0021.
#[inline(always)]
fn raised<S: Simd>(
    simd: S,
    square: f32x16<S>,
    sine_square: Option<f32x16<S>>,
    exponents: f32x16<S>,
) -> f32x16<S> {
    let first = exponents.to_array()[0];
    let power = raised_to(simd, square, sine_square, first);
    if bits(exponents.simd_eq(splat(simd, first))) == 0xffff {
        return power;
    }
    let mut power = power;
    let mut rest = 0xffff & !bits(exponents.simd_eq(splat(simd, first)));
    while rest != 0 {
        let exponent = exponents.to_array()[rest.trailing_zeros() as usize];
        // NaN equals nothing: the first lane is always done.
        let same = rest & bits(exponents.simd_eq(splat(simd, exponent))) | rest & rest.wrapping_neg();
        power = select(mask_of(simd, same), raised_to(simd, square, sine_square, exponent), power);
        rest &= !same;
    }
    power
}

/// sqrt(square)^exponent: small whole exponents by squaring, which is shorter, others by the series or by logarithms.
#[inline(always)]
fn raised_to<S: Simd>(
    simd: S,
    mut square: f32x16<S>,
    sine_square: Option<f32x16<S>>,
    exponent: f32,
) -> f32x16<S> {
    if !is_squared(exponent) {
        if let Some(sine_square) = sine_square
            && exponent >= binomial::LEAST_EXPONENT
        {
            return binomial::power(simd, sine_square, exponent);
        }
        let exponent = splat(simd, 0.5 * exponent);
        return exp2(simd, (log2(simd, square) * exponent).max(splat(simd, -126.0)));
    }
    let whole = exponent as u32;
    let mut power = if whole & 1 == 1 { square.sqrt() } else { splat(simd, 1.0) };
    let mut rest = whole >> 1;
    while rest != 0 {
        if rest & 1 == 1 {
            power *= square;
        }
        square = square * square;
        rest >>= 1;
    }
    power
}

/// The highlight of one lane in `f64`: an exponent of 10^6 multiplies the relative error of N.H by 10^6. `libm` is the same on
/// every platform.
#[inline(never)]
fn precise<S: Simd>(
    normals: Vec3x16<S>,
    to_light: Vec3x16<S>,
    to_viewer: Vec3x16<S>,
    lane: usize,
    exponent: f32,
) -> f32 {
    let vector = |v: Vec3x16<S>| glam::Vec3::from_array(v.0.map(|c| c[lane])).as_dvec3().normalize();
    let half = vector(to_light) + vector(to_viewer);
    let n_dot_h = vector(normals).dot(half) / half.length();
    // pow(0, 0) = 1.
    let power = libm::pow(n_dot_h.clamp(0.0, 1.0), f64::from(exponent));
    if power.is_nan() { 0.0 } else { power as f32 }
}
