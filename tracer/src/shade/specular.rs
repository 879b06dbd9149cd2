//! The highlight: Blinn's half vector, Phong's exponent.

use crate::simd::math::{exp2, log2};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, f32x16, select, splat};

/// Up to this exponent the rounding of N.H to `f32` stays below a fifth of a step of the 8-bit picture.
const SINGLE: f32 = 2000.0;

/// max(0, N.H)^p with H = (L + V) / |L + V|.
#[inline(always)]
pub(super) fn highlight<S: Simd>(
    simd: S,
    normals: Vec3x16<S>,
    to_light: Vec3x16<S>,
    to_viewer: Vec3x16<S>,
    exponents: &Lanes,
) -> f32x16<S> {
    let half = to_light.add(to_viewer).normalize(simd);
    let n_dot_h = normals.dot(half);
    let positive = n_dot_h.simd_gt(splat(simd, 1e-30));
    let base = select(positive, n_dot_h, splat(simd, 1.0)).min(splat(simd, 1.0));
    let power = exp2(simd, (log2(simd, base) * exponents.load(simd)).max(splat(simd, -126.0)));
    let mut power = select(positive, power, splat(simd, 0.0));
    for lane in 0..LANES {
        // Lane by lane: what a point looks like must not depend on which others stand in its block.
        if exponents.0[lane] > SINGLE || exponents.0[lane] == 0.0 {
            power.as_mut_slice()[lane] = precise(normals, to_light, to_viewer, lane, exponents.0[lane]);
        }
    }
    power
}

/// In `f64`: an exponent of 10^6 multiplies the relative error of N.H by as much. `libm` is the same on every platform.
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
    // Only an exponent of zero makes something of nothing: x^0 = 1.
    let power = libm::pow(n_dot_h.clamp(0.0, 1.0), f64::from(exponent));
    if power.is_nan() { 0.0 } else { power as f32 }
}
