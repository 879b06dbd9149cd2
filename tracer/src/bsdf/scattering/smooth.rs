//! Perfectly smooth surfaces in lanes: mirrored and refracted directions. V is the unit vector to the viewer, N a unit normal on its side.

use super::fresnel::transmitted_square;
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, SimdBase, SimdFloat, f32x16, select, splat, three};

/// R = 2 (N.V) N - V, on the side of the geometric normal.
#[inline(always)]
pub(super) fn reflected<S: Simd>(
    simd: S,
    to_viewer: Vec3x16<S>,
    normals: Vec3x16<S>,
    geometric: Vec3x16<S>,
) -> Vec3x16<S> {
    let cosine = normals.dot(to_viewer);
    on_side_of(simd, normals.scale(cosine + cosine).sub(to_viewer), geometric).normalize(simd)
}

/// T = (eta N.V - sqrt(1 - eta^2 (1 - (N.V)^2))) N - eta V; along the surface where all light is reflected.
#[inline(always)]
pub(super) fn refracted<S: Simd>(
    simd: S,
    to_viewer: Vec3x16<S>,
    normals: Vec3x16<S>,
    eta: f32x16<S>,
) -> Vec3x16<S> {
    let cosine = normals.dot(to_viewer);
    let transmitted = transmitted_square(simd, cosine, eta).max(splat(simd, 0.0)).sqrt();
    normals.scale(eta * cosine - transmitted).sub(to_viewer.scale(eta))
}

/// The directions on the same side of a surface as `normals`: others are mirrored at the surface.
#[inline(always)]
pub(super) fn on_side_of<S: Simd>(simd: S, directions: Vec3x16<S>, normals: Vec3x16<S>) -> Vec3x16<S> {
    let (zero, along) = (splat(simd, 0.0), directions.dot(normals));
    let behind = along.simd_lt(zero);
    let mirrored = directions.sub(normals.scale(along + along));
    Vec3x16(three!(i => select(behind, mirrored.0[i], directions.0[i])))
}
