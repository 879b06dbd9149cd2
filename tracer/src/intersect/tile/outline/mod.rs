//! Outlines of spheres in the picture of a projection: conics, and the range of the closeness.
//!
//! With the columns w of the inverse of the projection's linear part, the ray of the place (x, y) has the direction
//! D = w0 x + w1 y + w2 from the projection's point, or is parallel to D = w2 through w0 x + w1 y. With k from the point of
//! the projection to the centre of a sphere of radius r, the ray passes through the sphere where
//!
//! ```text
//!   from a point: F = r^2 |D|^2 - |D x k|^2 >= 0        parallel: F = r^2 |D|^2 - |(w0 x + w1 y - k) x D|^2 >= 0
//! ```
//!
//! F is a polynomial of degree two in x and y. Its factors are computed in `f64` around the middle of the tile and rounded,
//! so that five fused operations test sixteen rays. Two spheres are tested in place of the given one: a larger one that no
//! ray outside of which hits the given one, and a smaller one that only rays that hit the given one pass through.

use glam::DVec3;

use crate::rays::{Projection, ROUNDING, TileRays};
use crate::shape::EyeSphere;
use crate::simd::{Simd, SimdBase, bits, f32x16, fma, splat};

/// Difference of the radii in eye units: the padding of the boxes of the scene's tree. It exceeds the rounding of rays that
/// start within the scene.
const PADDING: f64 = 1.0 / (1 << 20) as f64;

/// Difference of the radii relative to the largest number of the computation. Its square exceeds the rounding of F.
const RELATIVE: f64 = 1.0 / (1 << 22) as f64;

/// Error of F in `f32`, relative to the sum of its terms: 8 times that of the eleven roundings.
const EVALUATION: f64 = 1.0 / (1 << 20) as f64;

/// The rays of a tile as lines in eye space.
pub(super) struct PictureLines<'a> {
    projection: &'a Projection,
    /// Columns of the inverse of the projection's linear part.
    columns: [DVec3; 3],
    /// Middle of the places of the rays, largest distance from it on each axis, and error bound of the places.
    middle: [f64; 2],
    half: [f64; 2],
    error: f64,
    /// Length of the projection's row of depths.
    depth_factor: f64,
    /// Whether the inverse is precise enough; if not, nothing is certain.
    is_precise: bool,
}

impl<'a> PictureLines<'a> {
    #[cold]
    #[inline(never)]
    pub(super) fn new(projection: &'a Projection, rays: &TileRays) -> Self {
        let rows @ [a, b, g] = projection.factors();
        let volume = a.dot(b.cross(g));
        let columns = [b.cross(g), g.cross(a), a.cross(b)].map(|column| column / volume);
        let [x_lo, x_hi, y_lo, y_hi] = rays.union.map(f64::from);
        let reach = f64::from(rays.reach());
        let error = f64::from(rays.error) + f64::from(ROUNDING) * reach;
        // Errors of the inverse move a place by less than half of the error bound.
        let scale = [reach, reach, 1.0];
        let residual = |i: usize, j: usize| {
            let one = if i == j { 1.0 } else { 0.0 };
            (rows[i].dot(columns[j]) - one).abs() * scale[j] * (1.0 + if i == 2 { reach } else { 0.0 })
        };
        let off = (0..9).map(|at| residual(at / 3, at % 3)).sum::<f64>();
        Self {
            projection,
            columns,
            middle: [f64::midpoint(x_lo, x_hi), f64::midpoint(y_lo, y_hi)].map(|at| f64::from(at as f32)),
            half: [(x_hi - x_lo) / 2.0, (y_hi - y_lo) / 2.0]
                .map(|half| half + 2.0 * error + f64::from(ROUNDING) * reach),
            error,
            depth_factor: g.length(),
            is_precise: off <= error / 2.0,
        }
    }

    /// The outline of a sphere.
    #[inline(never)]
    pub(super) fn outline(&self, sphere: &EyeSphere) -> Outline {
        let EyeSphere { center, radius } = *sphere;
        let projection = self.projection;
        let placed = projection.exact(center);
        let [w0, w1, w2] = self.columns;
        let to_center = w0 * placed.x + w1 * placed.y + w2 * placed.z;
        let padding = PADDING + RELATIVE * (to_center.length() + center.length() + radius);
        let (larger, smaller) = (radius + padding, radius - padding);
        let half_depth = larger * self.depth_factor + f64::from(projection.error[1]);
        let (nearest, farthest) = (placed.z - half_depth, placed.z + half_depth);
        let [z_low, z_high] = if projection.parallel {
            let rounding = f64::from(ROUNDING) * (nearest.abs() + farthest.abs());
            [-farthest - rounding, -nearest + rounding]
        } else if nearest > 0.0 {
            [(1.0 - f64::from(ROUNDING)) / farthest, (1.0 + f64::from(ROUNDING)) / nearest]
        } else {
            [f64::NEG_INFINITY, f64::INFINITY]
        };
        let [x0, y0] = self.middle;
        let place = w0 * x0 + w1 * y0;
        // The direction, and the cross product in F, each as constant and factors of x and y.
        let [directions, across] = if projection.parallel {
            [[w2, DVec3::ZERO, DVec3::ZERO], [(place - to_center).cross(w2), w0.cross(w2), w1.cross(w2)]]
        } else {
            let directions = [place + w2, w0, w1];
            [directions, directions.map(|direction| direction.cross(to_center))]
        };
        let outside = Conic::new(&directions, &across, larger);
        let inside = Conic::new(&directions, &across, smaller);
        Outline {
            middle: [x0 as f32, y0 as f32],
            larger: outside.shifted(outside.error(self.half, self.error)),
            smaller: inside.shifted(-inside.error(self.half, self.error)),
            may_miss: self.is_precise,
            may_be_inside: self.is_precise && smaller > 0.0,
            z_low: z_low as f32,
            z_high: z_high as f32,
        }
    }
}

/// A sphere in the picture.
pub(super) struct Outline {
    middle: [f32; 2],
    /// The error bounds are in the constants: rays with F below zero miss the sphere, those with F above zero hit it.
    larger: [f32; 6],
    smaller: [f32; 6],
    may_miss: bool,
    may_be_inside: bool,
    /// Bounds of the closeness of all points of the sphere.
    pub z_low: f32,
    pub z_high: f32,
}

impl Outline {
    /// Bits of the rays of a block that may hit the sphere, and of those whose lines pass through it for certain.
    #[inline(always)]
    pub(super) fn at<S: Simd>(&self, simd: S, rays: &TileRays, block: usize) -> [u32; 2] {
        let x = rays.x[block].load(simd) - splat(simd, self.middle[0]);
        let y = rays.y[block].load(simd) - splat(simd, self.middle[1]);
        let zero = splat(simd, 0.0);
        // All that is not outside for certain, even if a number is NaN.
        let missed = bits(value(simd, &self.larger, x, y).simd_lt(zero));
        let inside = bits(value(simd, &self.smaller, x, y).simd_gt(zero));
        let missed = if self.may_miss { missed } else { 0 };
        [0xffff & !missed, if self.may_be_inside { inside & !missed } else { 0 }]
    }
}

/// The value of a conic, rounded in any way.
#[inline(always)]
fn value<S: Simd>(simd: S, conic: &[f32; 6], x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
    let [c, cx, cy, cxx, cxy, cyy] = conic.map(|factor| splat(simd, factor));
    let of_x = fma(fma(cxx, x, fma(cxy, y, cx)), x, c);
    fma(fma(cyy, y, cy), y, of_x)
}

/// F of one radius: the constant, and the factors of x, y, x^2, xy and y^2.
struct Conic([f64; 6]);

impl Conic {
    fn new(directions: &[DVec3; 3], across: &[DVec3; 3], radius: f64) -> Self {
        let square = radius * radius;
        let product =
            |i: usize, j: usize| square * directions[i].dot(directions[j]) - across[i].dot(across[j]);
        Self([
            product(0, 0),
            2.0 * product(0, 1),
            2.0 * product(0, 2),
            product(1, 1),
            2.0 * product(1, 2),
            product(2, 2),
        ])
    }

    /// Error bound of F in `f32`, at places with an error.
    fn error(&self, [x, y]: [f64; 2], of_places: f64) -> f64 {
        let [c, cx, cy, cxx, cxy, cyy] = self.0.map(f64::abs);
        let terms = c + cx * x + cy * y + cxx * x * x + cxy * x * y + cyy * y * y;
        let slope = cx + cy + 2.0 * (cxx * x + cyy * y) + cxy * (x + y);
        EVALUATION * terms + of_places * slope
    }

    /// Factors in `f32`, with a number added to the constant.
    fn shifted(&self, by: f64) -> [f32; 6] {
        let [c, cx, cy, cxx, cxy, cyy] = self.0;
        [c + by, cx, cy, cxx, cxy, cyy].map(|factor| factor as f32)
    }
}

#[cfg(test)]
mod tests;
