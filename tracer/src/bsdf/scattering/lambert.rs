//! Diffuse reflection: f = c_d / pi.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

use super::Evaluated;
use crate::simd::math::sin_cos;
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, SimdBase, SimdFloat, f32x16, select, splat};

/// f cos and the density cos / pi, of directions at these cosines to the normal; zero behind the surface.
#[inline(always)]
pub(super) fn eval<S: Simd>(simd: S, diffuse: Vec3x16<S>, cosine: f32x16<S>) -> Evaluated<S> {
    let density = cosine.max(splat(simd, 0.0)) * splat(simd, FRAC_1_PI);
    Evaluated { value: diffuse.scale(density), density }
}

/// Directions with density cos / pi, and that density: a point of the unit disk, projected onto the hemisphere (Malley).
#[inline(always)]
pub(super) fn sample<S: Simd>(simd: S, normals: Vec3x16<S>, at: [f32x16<S>; 2]) -> (Vec3x16<S>, f32x16<S>) {
    let [x, y] = on_disk(simd, at);
    let height = (splat(simd, 1.0) - x * x - y * y).max(splat(simd, 0.0)).sqrt();
    let [tangent, bitangent] = normals.basis(simd);
    let direction = tangent.scale(x).add(bitangent.scale(y)).add(normals.scale(height)).normalize(simd);
    (direction, height * splat(simd, FRAC_1_PI))
}

/// Points of the unit disk by the concentric map (Shirley and Chiu 1997).
#[inline(always)]
pub(super) fn on_disk<S: Simd>(simd: S, [u, v]: [f32x16<S>; 2]) -> [f32x16<S>; 2] {
    let (one, two) = (splat(simd, 1.0), splat(simd, 2.0));
    let (x, y) = (u * two - one, v * two - one);
    let wide = x.abs().simd_gt(y.abs());
    let (radius, other) = (select(wide, x, y), select(wide, y, x));
    let nonzero = select(radius.abs().simd_gt(splat(simd, 0.0)), radius, one);
    let turn = splat(simd, FRAC_PI_4) * (other / nonzero);
    let angle = select(wide, turn, splat(simd, FRAC_PI_2) - turn);
    let [sin, cos] = sin_cos(simd, angle);
    [radius * cos, radius * sin]
}
