//! Triangles become lines and a depth plane in the picture of a lens.
//!
//! With all corners before the lens: places (x, y) = (a, b) / g and closeness z = 1 / g. The line through two corners is
//! E(x, y) = e + ex x + ey y, above zero on the inside; z is linear in the picture, too (Olano and Greer, "Triangle Scan
//! Conversion using 2D Homogeneous Coordinates", 1997). Sixteen triangles at once, with a bound for the error of E
//! and of z. A triangle that reaches behind the lens takes the long way, alone and in `f64`.

use glam::DVec3;

use super::Rays;
use super::lens::{Lens, ROUNDING};
use crate::mesh::TriangleBlock;
use crate::simd::{Lanes, Simd, SimdBase, SimdFloat, bits, f32x16, fma, mask_of, select, splat, three};

/// Sixteen triangles in the picture, lane by lane.
pub(super) struct Flats {
    /// Constants of the three lines, with their errors added: below zero is outside for certain.
    e: [Lanes; 3],
    ex: [Lanes; 3],
    ey: [Lanes; 3],
    /// Twice the largest error of the three: above it is inside for certain.
    slack: Lanes,
    /// Closeness: constant, and per x and y.
    z: [Lanes; 3],
    /// Error of the closeness.
    pub z_error: Lanes,
    /// Rectangles around them: x from and to, y from and to.
    pub around: [Lanes; 4],
    /// No point of a triangle is closer.
    pub z_most: Lanes,
    /// Bits of those to be covered. All other lanes mean nothing.
    pub seen: u32,
}

impl Flats {
    pub(super) const EMPTY: Flats = Flats {
        e: [Lanes::ZERO; 3],
        ex: [Lanes::ZERO; 3],
        ey: [Lanes::ZERO; 3],
        slack: Lanes::ZERO,
        z: [Lanes::ZERO; 3],
        z_error: Lanes::ZERO,
        around: [Lanes::ZERO; 4],
        z_most: Lanes::ZERO,
        seen: 0,
    };

    /// Sets up a block of triangles. Those beside the rays, or nowhere as close as `least_closeness`, are not seen. With
    /// `ON_GRID`, neither are those that lie between the rays of a grid with step 1. Returns the bits of those that reach
    /// behind the lens: they want [`Flats::set_up_exactly`].
    #[inline(always)]
    pub(super) fn set_up<S: Simd, const ON_GRID: bool>(
        &mut self,
        simd: S,
        block: &TriangleBlock,
        lens: &Lens,
        rays: &Rays,
        least_closeness: f32,
    ) -> u32 {
        let zero = splat(simd, 0.0);
        let g = three!(k => row(simd, lens.rows[2], &block.0[k]));
        let g_error = splat(simd, 8.0 * lens.error[1]);
        let g_least = g[0].min(g[1]).min(g[2]);
        let g_most = g[0].max(g[1]).max(g[2]);
        // Lanes without a triangle are NaN, and fail all comparisons.
        let (before, crossing) = if lens.parallel {
            (bits(g_least.simd_le(g_most)), 0)
        } else {
            (bits(g_least.simd_gt(g_error)), bits(g_least.simd_le(g_error) & g_most.simd_ge(-g_error)))
        };

        let one = splat(simd, 1.0);
        let scale = three!(k => if lens.parallel { one } else { one / g[k] });
        let z = three!(k => if lens.parallel { -g[k] } else { scale[k] });
        let x = three!(k => row(simd, lens.rows[0], &block.0[k]) * scale[k]);
        let y = three!(k => row(simd, lens.rows[1], &block.0[k]) * scale[k]);
        let scale = scale[0].max(scale[1]).max(scale[2]);
        let z_most = z[0].max(z[1]).max(z[2]);
        let (x_lo, x_hi) = (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]));
        let (y_lo, y_hi) = (y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]));
        // How far a corner may be off in the picture.
        let far = x_lo.abs().max(x_hi.abs()).max(y_lo.abs()).max(y_hi.abs());
        let g_off = if lens.parallel { zero } else { splat(simd, lens.error[1]) };
        let off = (splat(simd, lens.error[0]) + far * g_off) * scale + far * splat(simd, ROUNDING);
        let margin = off + splat(simd, rays.error);
        let (x_lo, x_hi, y_lo, y_hi) = (x_lo - margin, x_hi + margin, y_lo - margin, y_hi + margin);
        // d(1 / g) = dg / g^2.
        let z_rounding =
            scale * scale * splat(simd, 2.0 * lens.error[1]) + z_most.abs() * splat(simd, 8.0 * ROUNDING);
        let z_most = z_most + z_rounding;
        let mut inside = x_lo.simd_le(splat(simd, rays.union[1]))
            & x_hi.simd_ge(splat(simd, rays.union[0]))
            & y_lo.simd_le(splat(simd, rays.union[3]))
            & y_hi.simd_ge(splat(simd, rays.union[2]))
            & z_most.simd_ge(splat(simd, least_closeness));
        if ON_GRID {
            // Rays stand at whole numbers and a half.
            let half = splat(simd, 0.5);
            inside = inside
                & (x_hi - half).floor().simd_ge(x_lo - half)
                & (y_hi - half).floor().simd_ge(y_lo - half);
        }
        self.seen = before & bits(inside);
        if self.seen == 0 {
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
        // Inside a triangle closeness is a mean of that of its corners, so an error of the weights (by places, and by
        // rounding of the gradient) counts by how much the corners differ.
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

    /// The long way for one triangle that reaches behind the lens, or has more digits than a mesh: in `f64`, with lines from
    /// the cross products of (a, b, g), which need no division. It is not seen if it lies beside the picture. `corners` are
    /// in the space that the lens looks at.
    pub(super) fn set_up_exactly(&mut self, lane: usize, lens: &Lens, corners: [DVec3; 3], rays: &Rays) {
        self.seen = 0;
        let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let corners = three!(k => lens.exact(corners[k]));
        // z g at the corners, with g = 1 for parallel rays.
        let closeness = three!(k => if lens.parallel { -corners[k].z } else { 1.0 });
        let [a, b, c] = three!(k => if lens.parallel { corners[k].with_z(1.0) } else { corners[k] });
        let normals = [b.cross(c), c.cross(a), a.cross(b)];
        let determinant = a.dot(normals[0]);
        let scale = normals[0].abs().max(normals[1].abs()).max(normals[2].abs()).max_element();
        // What the corners are off by, in the normals and in the determinant.
        let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
        let normal_error = 8.0 * lens.exact_error * largest;
        let determinant_error = 3.0 * (lens.exact_error * scale + largest * normal_error);
        if !(determinant.abs() > determinant_error && scale.is_finite()) {
            // Edge-on to nearly the last digit.
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
        let sum_error = 3.0 * (normal_error * most + lens.exact_error * scale);
        let gradient_error = (sum_error + z.abs().max_element() * determinant_error) / determinant.abs();
        let [zx, zy, z0] = z.as_vec3().to_array();
        for (lanes, number) in self.z.iter_mut().zip([z0, zx, zy]) {
            lanes.0[lane] = number;
        }
        // Moved across itself, the plane comes as much closer as its distance from the lens changes by.
        let drift = if lens.drift > 0.0 {
            lens.drift * across.length() * lens.volume() / determinant.abs()
        } else {
            0.0
        };
        let z_error = (4.0 * ROUNDING + drift as f32) * size([z0, zx, zy])
            + (zx.abs() + zy.abs()) * rays.error
            + gradient_error as f32 * (1.0 + 2.0 * reach);
        self.z_error.0[lane] = z_error;
        for (lanes, side) in self.around.iter_mut().zip(rays.union) {
            lanes.0[lane] = side;
        }
        // Of the plane over the tile: the triangle itself may reach behind the lens.
        let [x_lo, x_hi, y_lo, y_hi] = rays.union;
        self.z_most.0[lane] = z0 + (zx * x_lo).max(zx * x_hi) + (zy * y_lo).max(zy * y_hi) + z_error;
        self.seen = 1 << lane;
    }

    /// A triangle of which nothing can be told: it may be anywhere, and every ray is asked about it.
    #[cold]
    fn set_unknown(&mut self, lane: usize, rays: &Rays) {
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
        self.seen = 1 << lane;
    }

    /// The rectangle around all triangles that are seen (with the error of the rays), and a closeness that none of them
    /// exceeds.
    #[inline(always)]
    pub(super) fn hull<S: Simd>(&self, simd: S) -> ([f32; 4], f32) {
        let seen = mask_of(simd, self.seen);
        let infinite = splat(simd, f32::INFINITY);
        let [x_lo, x_hi, y_lo, y_hi] = &self.around;
        let around = [
            select(seen, x_lo.load(simd), infinite).reduce_min(),
            select(seen, x_hi.load(simd), -infinite).reduce_max(),
            select(seen, y_lo.load(simd), infinite).reduce_min(),
            select(seen, y_hi.load(simd), -infinite).reduce_max(),
        ];
        (around, select(seen, self.z_most.load(simd), -infinite).reduce_max())
    }

    /// Triangles that may touch a rectangle (x from and to, y from and to) and are somewhere as close as `least_closeness`.
    #[inline(always)]
    pub(super) fn touching<S: Simd>(&self, simd: S, rectangle: [f32; 4], least_closeness: f32) -> u32 {
        let [x_lo, x_hi, y_lo, y_hi] = &self.around;
        self.seen
            & bits(
                x_lo.load(simd).simd_le(splat(simd, rectangle[1]))
                    & x_hi.load(simd).simd_ge(splat(simd, rectangle[0]))
                    & y_lo.load(simd).simd_le(splat(simd, rectangle[3]))
                    & y_hi.load(simd).simd_ge(splat(simd, rectangle[2]))
                    & self.z_most.load(simd).simd_ge(splat(simd, least_closeness)),
            )
    }

    /// A line of a triangle at sixteen places.
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

/// A row of a lens for the same corner of sixteen triangles.
#[inline(always)]
fn row<S: Simd>(simd: S, row: [f32; 4], corner: &[Lanes; 3]) -> f32x16<S> {
    let xy = fma(splat(simd, row[1]), corner[1].load(simd), splat(simd, row[3]));
    let z = fma(splat(simd, row[2]), corner[2].load(simd), xy);
    fma(splat(simd, row[0]), corner[0].load(simd), z)
}

/// The lines and the closeness of triangles at places: one triangle at sixteen, or sixteen at one.
pub(super) struct At<S: Simd> {
    /// Inside, or too close to a line to tell.
    pub maybe: u32,
    /// Inside for certain.
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
