//! The GGX distribution of microfacets (Walter et al., "Microfacet models for refraction through rough surfaces", 2007) with the
//! height-correlated Smith masking-shadowing (Heitz, "Understanding the masking-shadowing function", 2014). Half vectors are sampled among
//! the visible ones by spherical caps (Dupuy and Benyoub, "Sampling visible GGX normals with spherical caps", 2023).
//!
//! ```text
//! D(h)   = 1 / (pi alpha^2 ((x^2 + y^2) / alpha^2 + z^2)^2)
//! S(w)   = sqrt(alpha^2 + (1 - alpha^2) (n.w)^2)
//! f1 cos = D n.l / (2 (n.l S(v) + n.v S(l)))
//! p(l)   = D / (2 (n.v + S(v)))
//! ```
//!
//! f1 is the reflection with a Fresnel share of 1. Vectors are in the frame of the normal: z along it.

use std::f32::consts::{FRAC_1_PI, TAU};

use crate::simd::math::sin_cos;
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, SimdBase, SimdFloat, f32x16, mask32x16, select, splat};

/// Least alpha: smoother surfaces are perfectly smooth.
pub(super) const LEAST_ALPHA: f32 = 1e-3;

/// Rough surfaces at sixteen points, seen by sixteen viewers.
pub(super) struct Microfacets<S: Simd> {
    pub alpha: f32x16<S>,
    /// Tangent, bitangent and normal.
    axes: [Vec3x16<S>; 3],
    /// Unit vectors to the viewers, above the surface.
    pub viewer: Vec3x16<S>,
}

/// The reflection of one direction.
pub(super) struct Reflection<S: Simd> {
    /// f1 cos; zero below the surface.
    pub value: f32x16<S>,
    /// Density over solid angle of mirrored directions at visible half vectors, above and below the surface.
    pub density: f32x16<S>,
    /// v.h.
    pub cosine: f32x16<S>,
}

impl<S: Simd> Microfacets<S> {
    /// Surfaces with unit normals, on the side of the viewers.
    #[inline(always)]
    pub(super) fn new(simd: S, alpha: f32x16<S>, normals: Vec3x16<S>, to_viewer: Vec3x16<S>) -> Self {
        let [tangent, bitangent] = normals.basis(simd);
        let axes = [tangent, bitangent, normals];
        Self { alpha, axes, viewer: into(axes, to_viewer) }
    }

    /// A vector in the frame of the normal.
    #[inline(always)]
    pub(super) fn local(&self, vector: Vec3x16<S>) -> Vec3x16<S> {
        into(self.axes, vector)
    }

    /// A vector out of the frame of the normal.
    #[inline(always)]
    pub(super) fn global(&self, vector: Vec3x16<S>) -> Vec3x16<S> {
        let [tangent, bitangent, normal] = self.axes;
        let [x, y, z] = vector.0;
        tangent.scale(x).add(bitangent.scale(y)).add(normal.scale(z))
    }

    /// Random visible half vectors of unit length.
    #[inline(always)]
    pub(super) fn half_vectors(&self, simd: S, [u, v]: [f32x16<S>; 2]) -> Vec3x16<S> {
        let one = splat(simd, 1.0);
        let [x, y, z] = self.viewer.0;
        let [x, y, z] = Vec3x16([x * self.alpha, y * self.alpha, z]).normalize(simd).0;
        let [sin, cos] = sin_cos(simd, u * splat(simd, TAU));
        let height = (one - v) * (one + z) - z;
        let radius = ((one - height) * (one + height)).max(splat(simd, 0.0)).sqrt();
        let (across, along) = (radius * cos + x, radius * sin + y);
        let up = (height + z).max(splat(simd, 1e-12));
        Vec3x16([across * self.alpha, along * self.alpha, up]).normalize(simd)
    }

    /// The viewers' directions, mirrored at half vectors, and v.h. Some are below the surface.
    #[inline(always)]
    pub(super) fn mirrored(&self, half: Vec3x16<S>) -> (Vec3x16<S>, f32x16<S>) {
        let cosine = self.viewer.dot(half);
        (half.scale(cosine + cosine).sub(self.viewer), cosine)
    }

    /// The reflection of directions.
    #[inline(always)]
    pub(super) fn reflection(&self, simd: S, light: Vec3x16<S>) -> Reflection<S> {
        let (zero, one, two) = (splat(simd, 0.0), splat(simd, 1.0), splat(simd, 2.0));
        let (cos_v, cos_l) = (self.viewer.0[2], light.0[2]);
        let above: mask32x16<S> = cos_l.simd_gt(zero);
        let cos_l = select(above, cos_l, one);
        let sum = self.viewer.add(light);
        let length = sum.dot(sum).max(splat(simd, 1e-12)).sqrt();
        let [x, y, z] = sum.scale(one / length).0;
        let square = self.alpha * self.alpha;
        let slope = (x * x + y * y) / square + z * z;
        let distribution = splat(simd, FRAC_1_PI) / (square * slope * slope);
        let smith = |cosine: f32x16<S>| (square + (one - square) * cosine * cosine).sqrt();
        let (of_viewer, of_light) = (smith(cos_v), smith(cos_l));
        let value = distribution * cos_l / (two * (cos_l * of_viewer + cos_v * of_light));
        let density = select(z.simd_gt(zero), distribution / (two * (cos_v + of_viewer)), zero);
        let cosine = length * splat(simd, 0.5);
        Reflection { value: select(above, value, zero), density, cosine }
    }
}

#[inline(always)]
fn into<S: Simd>(axes: [Vec3x16<S>; 3], vector: Vec3x16<S>) -> Vec3x16<S> {
    let [tangent, bitangent, normal] = axes;
    Vec3x16([tangent.dot(vector), bitangent.dot(vector), normal.dot(vector)])
}
