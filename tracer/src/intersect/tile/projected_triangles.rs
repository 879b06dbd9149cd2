//! Triangles as lines and a depth plane in the picture of a projection.
//!
//! Corners in front of the projection have places (x, y) = (a, b) / g and closeness z = 1 / g. The line through two corners
//! is E(x, y) = e + ex x + ey y, positive inside; z is linear in the picture, too (Olano and Greer, "Triangle Scan Conversion
//! using 2D Homogeneous Coordinates", 1997). Sixteen triangles are projected at once, with error bounds of E and of z. A
//! triangle that reaches behind the projection is projected alone and in `f64`.

use glam::DVec3;

use crate::mesh::TriangleBlock;
use crate::rays::{Projection, ROUNDING, TileRays};
use crate::simd::{Lanes, Simd, SimdBase, SimdFloat, bits, f32x16, fma, mask_of, select, splat, three};

/// Sixteen triangles in the picture, lane by lane.
pub(super) struct ProjectedTriangles {
    /// The three lines: constants, and factors of x and y. The error bounds are added to the constants: below zero is outside
    /// for certain.
    e: [Lanes; 3],
    ex: [Lanes; 3],
    ey: [Lanes; 3],
    /// Twice the largest error bound of the three: above it is inside for certain.
    slack: Lanes,
    /// Closeness: constant, and factors of x and y.
    z: [Lanes; 3],
    /// Error bound of the closeness.
    pub z_error: Lanes,
    /// Rectangles around the triangles: x from and to, y from and to.
    pub around: [Lanes; 4],
    /// Greatest closeness of each triangle.
    pub z_most: Lanes,
    /// Bits of the lanes that hold a triangle to be tested; all others are undefined.
    pub active: u32,
}

impl ProjectedTriangles {
    pub(super) const EMPTY: ProjectedTriangles = ProjectedTriangles {
        e: [Lanes::ZERO; 3],
        ex: [Lanes::ZERO; 3],
        ey: [Lanes::ZERO; 3],
        slack: Lanes::ZERO,
        z: [Lanes::ZERO; 3],
        z_error: Lanes::ZERO,
        around: [Lanes::ZERO; 4],
        z_most: Lanes::ZERO,
        active: 0,
    };

    /// Projects a block of triangles. Those outside the rays, or nowhere as close as `least_closeness`, are not active; with
    /// `ON_GRID`, neither are those between the rays of a grid with step 1. Returns the bits of the triangles that reach behind
    /// the projection, for [`ProjectedTriangles::project_exactly`].
    #[inline(always)]
    pub(super) fn project<S: Simd, const ON_GRID: bool>(
        &mut self,
        simd: S,
        block: &TriangleBlock,
        projection: &Projection,
        rays: &TileRays,
        least_closeness: f32,
    ) -> u32 {
        let zero = splat(simd, 0.0);
        let g = three!(k => row(simd, projection.rows[2], &block.0[k]));
        let g_error = splat(simd, 8.0 * projection.error[1]);
        let g_least = g[0].min(g[1]).min(g[2]);
        let g_most = g[0].max(g[1]).max(g[2]);
        // Empty lanes are NaN, and fail all comparisons.
        let (before, crossing) = if projection.parallel {
            (bits(g_least.simd_le(g_most)), 0)
        } else {
            (bits(g_least.simd_gt(g_error)), bits(g_least.simd_le(g_error) & g_most.simd_ge(-g_error)))
        };

        let one = splat(simd, 1.0);
        let scale = three!(k => if projection.parallel { one } else { one / g[k] });
        let z = three!(k => if projection.parallel { -g[k] } else { scale[k] });
        let x = three!(k => row(simd, projection.rows[0], &block.0[k]) * scale[k]);
        let y = three!(k => row(simd, projection.rows[1], &block.0[k]) * scale[k]);
        let scale = scale[0].max(scale[1]).max(scale[2]);
        let z_most = z[0].max(z[1]).max(z[2]);
        let (x_lo, x_hi) = (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]));
        let (y_lo, y_hi) = (y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]));
        // Error bound of a corner's place.
        let far = x_lo.abs().max(x_hi.abs()).max(y_lo.abs()).max(y_hi.abs());
        let g_off = if projection.parallel { zero } else { splat(simd, projection.error[1]) };
        let off = (splat(simd, projection.error[0]) + far * g_off) * scale + far * splat(simd, ROUNDING);
        let margin = off + splat(simd, rays.error);
        let (x_lo, x_hi, y_lo, y_hi) = (x_lo - margin, x_hi + margin, y_lo - margin, y_hi + margin);
        // d(1 / g) = dg / g^2.
        let z_rounding = scale * scale * splat(simd, 2.0 * projection.error[1])
            + z_most.abs() * splat(simd, 8.0 * ROUNDING);
        let z_most = z_most + z_rounding;
        let mut inside = x_lo.simd_le(splat(simd, rays.union[1]))
            & x_hi.simd_ge(splat(simd, rays.union[0]))
            & y_lo.simd_le(splat(simd, rays.union[3]))
            & y_hi.simd_ge(splat(simd, rays.union[2]))
            & z_most.simd_ge(splat(simd, least_closeness));
        if ON_GRID {
            // Rays are at whole numbers plus a half.
            let half = splat(simd, 0.5);
            inside = inside
                & (x_hi - half).floor().simd_ge(x_lo - half)
                & (y_hi - half).floor().simd_ge(y_lo - half);
        }
        self.active = before & bits(inside);
        if self.active == 0 {
            return crossing;
        }

        let [abx, aby, acx, acy] = [x[1] - x[0], y[1] - y[0], x[2] - x[0], y[2] - y[0]];
        let area = abx * acy - aby * acx;
        let sign = one.copysign(area);
        let near_zero = splat(simd, ROUNDING);
        let local = splat(simd, rays.reach());
        let mut slack = zero;
        for (edge, (from, to)) in [(0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
            let ex = (y[from] - y[to]) * sign;
            let ey = (x[to] - x[from]) * sign;
            let e = -fma(ex, x[from], ey * y[from]);
            let size = ex.abs() + ey.abs();
            let distance = x[from].abs() + y[from].abs() + local;
            let error = size * fma(distance, near_zero, margin * splat(simd, 3.0));
            self.e[edge].store(e + error);
            self.ex[edge].store(ex);
            self.ey[edge].store(ey);
            slack = slack.max(error * splat(simd, 2.0));
        }
        self.slack.store(slack);
        let (ab, ac) = (z[1] - z[0], z[2] - z[0]);
        let inverse = one / area;
        let zx = (ab * acy - ac * aby) * inverse;
        let zy = (ac * abx - ab * acx) * inverse;
        let steep = zx.abs() + zy.abs();
        let extent = (x_hi - x_lo) + (y_hi - y_lo);
        let distance = x[0].abs() + y[0].abs() + local;
        let by_place = steep * fma(distance, near_zero, margin * splat(simd, 4.0));
        // Inside a triangle closeness is a mean of the corners' closeness, so an error of the weights (of places, and of the
        // rounding of the gradient) counts in proportion to the range of the corners.
        let range = z[0].max(z[1]).max(z[2]) - z[0].min(z[1]).min(z[2]);
        let by_weights = range
            * extent
            * inverse.abs()
            * fma(extent, splat(simd, 4.0 * ROUNDING), margin * splat(simd, 8.0));
        let z_error = by_place + z_rounding * splat(simd, 4.0) + by_weights;
        self.z[0].store(z[0] - fma(zx, x[0], zy * y[0]));
        self.z[1].store(zx);
        self.z[2].store(zy);
        self.z_error.store(z_error.max(zero));
        self.around[0].store(x_lo);
        self.around[1].store(x_hi);
        self.around[2].store(y_lo);
        self.around[3].store(y_hi);
        self.z_most.store(z_most);
        crossing
    }

    /// Projects one triangle in `f64`: one that reaches behind the projection, or has more digits than a mesh. Its lines follow
    /// from cross products of (a, b, g), which need no division. A triangle outside the picture is not active. `corners` are in
    /// the projected space.
    pub(super) fn project_exactly(
        &mut self,
        lane: usize,
        projection: &Projection,
        corners: [DVec3; 3],
        rays: &TileRays,
    ) {
        self.active = 0;
        let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let corners = three!(k => projection.exact(corners[k]));
        // z g at the corners, with g = 1 for parallel rays.
        let closeness = three!(k => if projection.parallel { -corners[k].z } else { 1.0 });
        let [a, b, c] = three!(k => if projection.parallel { corners[k].with_z(1.0) } else { corners[k] });
        let normals = [b.cross(c), c.cross(a), a.cross(b)];
        let determinant = a.dot(normals[0]);
        let scale = normals[0].abs().max(normals[1].abs()).max(normals[2].abs()).max_element();
        // Error bounds of the normals and of the determinant, by those of the corners.
        let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
        let normal_error = 8.0 * projection.exact_error * largest;
        let determinant_error = 3.0 * (projection.exact_error * scale + largest * normal_error);
        if !(determinant.abs() > determinant_error && scale.is_finite()) {
            // Edge-on within rounding.
            return self.set_unknown(lane, rays);
        }
        let reach = rays.reach();
        let size = |[e, ex, ey]: [f32; 3]| e.abs() + reach * (ex.abs() + ey.abs());
        let line_error = (normal_error / scale) as f32 * (1.0 + 2.0 * reach);
        let mut slack = 0.0_f32;
        for (edge, normal) in normals.into_iter().enumerate() {
            let line = normal * (determinant.signum() / scale);
            let [ex, ey, e] = line.as_vec3().to_array();
            let error = 4.0 * ROUNDING * size([e, ex, ey]) + (ex.abs() + ey.abs()) * rays.error + line_error;
            let x = rays.union[usize::from(ex > 0.0)];
            let y = rays.union[2 + usize::from(ey > 0.0)];
            if e + error + ex * x + ey * y < 0.0 {
                return;
            }
            self.e[edge].0[lane] = e + error;
            self.ex[edge].0[lane] = ex;
            self.ey[edge].0[lane] = ey;
            slack = slack.max(2.0 * error);
        }
        self.slack.0[lane] = slack;
        let sum = normals[0] * closeness[0] + normals[1] * closeness[1] + normals[2] * closeness[2];
        let z = sum / determinant;
        let most = closeness[0].abs().max(closeness[1].abs()).max(closeness[2].abs());
        let sum_error = 3.0 * (normal_error * most + projection.exact_error * scale);
        let gradient_error = (sum_error + z.abs().max_element() * determinant_error) / determinant.abs();
        let [zx, zy, z0] = z.as_vec3().to_array();
        for (lanes, number) in self.z.iter_mut().zip([z0, zx, zy]) {
            lanes.0[lane] = number;
        }
        // A plane that moves across itself comes closer in proportion to the change of its distance from a point, and to parallel
        // rays by the way along them.
        let drift = if projection.drift > 0.0 {
            projection.drift * across.length() * projection.volume() / determinant.abs()
        } else {
            0.0
        };
        let drift = if projection.parallel { drift as f32 } else { drift as f32 * size([z0, zx, zy]) };
        let z_error = 4.0 * ROUNDING * size([z0, zx, zy])
            + drift
            + (zx.abs() + zy.abs()) * rays.error
            + gradient_error as f32 * (1.0 + 2.0 * reach);
        self.z_error.0[lane] = z_error;
        for (lanes, side) in self.around.iter_mut().zip(rays.union) {
            lanes.0[lane] = side;
        }
        // That of the plane over the tile: the triangle itself may reach behind the projection.
        let [x_lo, x_hi, y_lo, y_hi] = rays.union;
        self.z_most.0[lane] = z0 + (zx * x_lo).max(zx * x_hi) + (zy * y_lo).max(zy * y_hi) + z_error;
        self.active = 1 << lane;
    }

    /// Sets a triangle that may be anywhere, so that every ray is tested exactly.
    #[cold]
    fn set_unknown(&mut self, lane: usize, rays: &TileRays) {
        for edge in 0..3 {
            self.e[edge].0[lane] = 1.0;
            self.ex[edge].0[lane] = 0.0;
            self.ey[edge].0[lane] = 0.0;
            self.z[edge].0[lane] = 0.0;
        }
        self.slack.0[lane] = f32::INFINITY;
        self.z_error.0[lane] = f32::INFINITY;
        self.z_most.0[lane] = f32::INFINITY;
        for (lanes, side) in self.around.iter_mut().zip(rays.union) {
            lanes.0[lane] = side;
        }
        self.active = 1 << lane;
    }

    /// The rectangle around all active triangles (with the error bound of the rays), and their greatest closeness.
    #[inline(always)]
    pub(super) fn hull<S: Simd>(&self, simd: S) -> ([f32; 4], f32) {
        let active = mask_of(simd, self.active);
        let infinite = splat(simd, f32::INFINITY);
        let [x_lo, x_hi, y_lo, y_hi] = &self.around;
        let around = [
            select(active, x_lo.load(simd), infinite).reduce_min(),
            select(active, x_hi.load(simd), -infinite).reduce_max(),
            select(active, y_lo.load(simd), infinite).reduce_min(),
            select(active, y_hi.load(simd), -infinite).reduce_max(),
        ];
        (around, select(active, self.z_most.load(simd), -infinite).reduce_max())
    }

    /// Bits of the triangles that may touch a rectangle (x from and to, y from and to) and are as close as `least_closeness`
    /// somewhere.
    #[inline(always)]
    pub(super) fn touching<S: Simd>(&self, simd: S, rectangle: [f32; 4], least_closeness: f32) -> u32 {
        let [x_lo, x_hi, y_lo, y_hi] = &self.around;
        self.active
            & bits(
                x_lo.load(simd).simd_le(splat(simd, rectangle[1]))
                    & x_hi.load(simd).simd_ge(splat(simd, rectangle[0]))
                    & y_lo.load(simd).simd_le(splat(simd, rectangle[3]))
                    & y_hi.load(simd).simd_ge(splat(simd, rectangle[2]))
                    & self.z_most.load(simd).simd_ge(splat(simd, least_closeness)),
            )
    }

    /// One line of one triangle at sixteen places.
    #[inline(always)]
    fn line<S: Simd>(&self, simd: S, triangle: usize, edge: usize, x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
        let (e, ex, ey) = (self.e[edge].0[triangle], self.ex[edge].0[triangle], self.ey[edge].0[triangle]);
        fma(splat(simd, ex), x, fma(splat(simd, ey), y, splat(simd, e)))
    }

    /// One triangle at sixteen places.
    #[inline(always)]
    pub(super) fn triangle_at<S: Simd>(&self, simd: S, triangle: usize, x: f32x16<S>, y: f32x16<S>) -> At<S> {
        let lines = three!(edge => self.line(simd, triangle, edge, x, y));
        let slack = splat(simd, self.slack.0[triangle]);
        let z = three!(i => splat(simd, self.z[i].0[triangle]));
        At::of(simd, lines, slack, z, x, y)
    }

    /// All sixteen triangles at one place.
    #[inline(always)]
    pub(super) fn all_at<S: Simd>(&self, simd: S, x: f32, y: f32) -> At<S> {
        let (x, y) = (splat(simd, x), splat(simd, y));
        let lines = three!(edge => {
            let [e, ex, ey] = [self.e[edge].load(simd), self.ex[edge].load(simd), self.ey[edge].load(simd)];
            fma(ex, x, fma(ey, y, e))
        });
        let slack = self.slack.load(simd);
        let z = three!(i => self.z[i].load(simd));
        At::of(simd, lines, slack, z, x, y)
    }
}

/// A row of a projection at the same corner of sixteen triangles.
#[inline(always)]
fn row<S: Simd>(simd: S, row: [f32; 4], corner: &[Lanes; 3]) -> f32x16<S> {
    let xy = fma(splat(simd, row[1]), corner[1].load(simd), splat(simd, row[3]));
    let z = fma(splat(simd, row[2]), corner[2].load(simd), xy);
    fma(splat(simd, row[0]), corner[0].load(simd), z)
}

/// Triangles at places: one triangle at sixteen places, or sixteen triangles at one place.
pub(super) struct At<S: Simd> {
    /// Bits of the pairs inside, or too close to a line to be certain.
    pub maybe: u32,
    /// Bits of the pairs inside for certain.
    pub certain: u32,
    pub z: f32x16<S>,
}

impl<S: Simd> At<S> {
    #[inline(always)]
    fn of(
        simd: S,
        lines: [f32x16<S>; 3],
        slack: f32x16<S>,
        z: [f32x16<S>; 3],
        x: f32x16<S>,
        y: f32x16<S>,
    ) -> Self {
        let least = lines[0].min(lines[1]).min(lines[2]);
        let maybe = bits(least.simd_ge(splat(simd, 0.0)));
        let certain = bits(least.simd_gt(slack));
        Self { maybe, certain, z: fma(z[1], x, fma(z[2], y, z[0])) }
    }
}
