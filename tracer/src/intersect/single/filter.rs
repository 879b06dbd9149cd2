//! Filter of one ray against sixteen triangles in `f32`: certain hits, possible hits and misses.
//!
//! The test is that of [`crate::shape::ShearedRay`], with error bounds that contain the result of the exact test.

use super::near_ray::NearRay;
use crate::bvh::WIDTH;
use crate::mesh::TriangleBlock;
use crate::shape::axes_ending_with;
use crate::simd::{Simd, SimdBase, bits, f32x16, fma, select, splat, three};

/// A ray prepared for triangles: permuted and sheared so that it is parallel to the last axis.
pub(super) struct FilterRay {
    axes: [usize; 3],
    origin: [f32; 3],
    /// Shear of the other axes per unit of the last.
    shear: [f32; 2],
    /// Distance per unit of the last.
    per_depth: f32,
    error: f32,
}

impl FilterRay {
    #[inline(always)]
    pub(super) fn new(ray: &NearRay) -> Self {
        let axes = axes_ending_with(ray.axis);
        let per_depth = ray.inverse[ray.axis % 4];
        let shear = [-ray.direction[axes[0]] * per_depth, -ray.direction[axes[1]] * per_depth];
        let origin = three!(k => ray.origin[axes[k]]);
        Self { axes, origin, shear, per_depth, error: ray.error }
    }

    /// The triangles of a block that the ray may hit within [0, `reach`].
    #[inline(always)]
    pub(super) fn hits<S: Simd>(&self, simd: S, block: &TriangleBlock, reach: f32) -> Hits {
        let [x, y, z] = self.axes;
        let origin = three!(i => splat(simd, self.origin[i]));
        let shear = [splat(simd, self.shear[0]), splat(simd, self.shear[1])];
        let corners = three!(k => {
            let depth = block.0[k][z].load(simd) - origin[2];
            [
                fma(shear[0], depth, block.0[k][x].load(simd) - origin[0]),
                fma(shear[1], depth, block.0[k][y].load(simd) - origin[1]),
                depth,
            ]
        });
        let [a, b, c] = corners;
        let edges = [edge(c, b), edge(a, c), edge(b, a)];
        let size = (a[0].abs() + a[1].abs()).max(b[0].abs() + b[1].abs()).max(c[0].abs() + c[1].abs());
        // The error of an edge function: that of each coordinate times the other one, and two roundings.
        let error = splat(simd, self.error);
        let bound = (size + error) * splat(simd, 4.0 * self.error);
        let least = edges[0].min(edges[1]).min(edges[2]);
        let most = edges[0].max(edges[1]).max(edges[2]);
        let maybe = bits(least.simd_ge(-bound) | most.simd_le(bound));
        if maybe == 0 {
            return Hits::NONE;
        }
        let certain = bits(least.simd_gt(bound) | most.simd_lt(-bound));

        let per_depth = splat(simd, self.per_depth);
        let z = three!(k => corners[k][2] * per_depth);
        let (z_least, z_most) = (z[0].min(z[1]).min(z[2]), z[0].max(z[1]).max(z[2]));
        let sum = edges[0] + edges[1] + edges[2];
        let inverse = splat(simd, 1.0) / sum;
        let distance = fma(edges[0], z[0], fma(edges[1], z[1], edges[2] * z[2])) * inverse;
        // A mean of the corners' distances, whose weights have the error of the edge functions: see `Hits`.
        let spread = (z_most - z_least) * bound * inverse.abs() * splat(simd, 4.0);
        let error = splat(simd, self.error * self.per_depth.abs());
        let spread = fma(error, splat(simd, 3.0), spread);
        // Where it is not certain that the ray is inside, only the corners bound the distance.
        let inside = least.simd_gt(bound) | most.simd_lt(-bound);
        let low = select(inside, distance - spread, z_least - error);
        let high = select(inside, distance + spread, z_most + error);
        let within = bits(low.simd_le(splat(simd, reach)) & high.simd_ge(splat(simd, 0.0)));
        let positive = bits(low.simd_gt(splat(simd, 0.0)));
        let maybe = maybe & within;
        if maybe == 0 {
            return Hits::NONE;
        }
        Hits { maybe, certain: certain & positive, low: low.to_array(), high: high.to_array() }
    }
}

/// The triangles of a block that a ray may hit: one bit and one interval of distances a triangle.
///
/// The distance of a certain hit is sum(w z) / sum(w). The distances z of the corners have the error of coordinates, the
/// weights w an error of at most `bound`, and all weights have one sign. The errors of the shares w / sum(w) add up to at most
/// 6 bound / sum(w), half of it up and half down, so that of the mean is 3 bound / sum(w) times the spread of z.
pub(super) struct Hits {
    pub maybe: u32,
    pub certain: u32,
    pub low: [f32; WIDTH],
    pub high: [f32; WIDTH],
}

impl Hits {
    const NONE: Hits = Hits { maybe: 0, certain: 0, low: [0.0; WIDTH], high: [0.0; WIDTH] };
}

/// Edge function: twice the signed area between the ray and two corners.
#[inline(always)]
fn edge<S: Simd>(p: [f32x16<S>; 3], q: [f32x16<S>; 3]) -> f32x16<S> {
    fma(p[0], q[1], -(p[1] * q[0]))
}
