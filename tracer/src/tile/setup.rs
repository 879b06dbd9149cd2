//! Triangles become lines and a depth plane in the picture of a lens.
//!
//! With all corners before the lens: places (x, y) = (a, b) / g and closeness z = 1 / g. The line through two corners is
//! E(x, y) = e + ex x + ey y, above zero on the inside; z is linear in the picture, too (Olano and Greer, "Triangle Scan
//! Conversion using 2D Homogeneous Coordinates", 1997). Sixteen triangles at once, with a bound for the error of E
//! and of z. A triangle that reaches behind the lens takes the long way, alone and in `f64`.

use glam::{DVec3, Vec3};

use super::Rays;
use super::lens::{Lens, ROUNDING};
use crate::mesh::TriangleBlock;
use crate::simd::{Lanes, Simd, SimdBase, SimdFloat, bits, f32x16, fma, splat, three};

/// A triangle in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flat {
    /// Constants of the three lines, with `slack` added: below zero is outside for certain.
    pub e: [f32; 3],
    pub ex: [f32; 3],
    pub ey: [f32; 3],
    /// Twice the error of each line: above it is inside for certain.
    pub slack: [f32; 3],
    /// Closeness: constant, and per x and y.
    pub z: [f32; 3],
    /// Error of the closeness.
    pub z_error: f32,
    /// Rectangle around it: x from and to, y from and to.
    pub around: [f32; 4],
    /// No point of it is closer.
    pub z_most: f32,
    /// Its lines are needed to tell which blocks it touches: the rectangle says little.
    pub large: bool,
}

/// Sixteen of them, lane by lane.
pub(super) struct Flats {
    e: [Lanes; 3],
    ex: [Lanes; 3],
    ey: [Lanes; 3],
    slack: [Lanes; 3],
    z: [Lanes; 3],
    z_error: Lanes,
    around: [Lanes; 4],
    z_most: Lanes,
    /// Bits of those to be covered.
    pub seen: u32,
    /// Bits of those that reach behind the lens.
    pub crossing: u32,
}

impl Flats {
    pub(super) const EMPTY: Flats = Flats {
        e: [Lanes::ZERO; 3],
        ex: [Lanes::ZERO; 3],
        ey: [Lanes::ZERO; 3],
        slack: [Lanes::ZERO; 3],
        z: [Lanes::ZERO; 3],
        z_error: Lanes::ZERO,
        around: [Lanes::ZERO; 4],
        z_most: Lanes::ZERO,
        seen: 0,
        crossing: 0,
    };

    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> Flat {
        let [x_lo, x_hi, y_lo, y_hi] = &self.around;
        let around = [x_lo.0[lane], x_hi.0[lane], y_lo.0[lane], y_hi.0[lane]];
        Flat {
            e: three!(edge => self.e[edge].0[lane]),
            ex: three!(edge => self.ex[edge].0[lane]),
            ey: three!(edge => self.ey[edge].0[lane]),
            slack: three!(edge => self.slack[edge].0[lane]),
            z: three!(i => self.z[i].0[lane]),
            z_error: self.z_error.0[lane],
            around,
            z_most: self.z_most.0[lane],
            large: (around[1] - around[0]).min(around[3] - around[2]) > 6.0,
        }
    }

    /// Sets up a block of triangles. Those beside the rays, or nowhere as close as `least_closeness`, are not seen. With
    /// `ON_GRID`, neither are those that lie between the rays of a grid with step 1.
    #[inline(always)]
    pub(super) fn set_up<S: Simd, const ON_GRID: bool>(
        &mut self,
        simd: S,
        block: &TriangleBlock,
        lens: &Lens,
        rays: &Rays,
        least_closeness: f32,
    ) {
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
        self.crossing = crossing;

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
            return;
        }

        let [abx, aby, acx, acy] = [x[1] - x[0], y[1] - y[0], x[2] - x[0], y[2] - y[0]];
        let area = abx * acy - aby * acx;
        let sign = one.copysign(area);
        let near_zero = splat(simd, ROUNDING);
        let local = splat(simd, rays.reach());
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
            self.slack[edge].store(error * splat(simd, 2.0));
        }
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
        for (lanes, side) in self.around.iter_mut().zip([x_lo, x_hi, y_lo, y_hi]) {
            lanes.store(side);
        }
        self.z_most.store(z_most);
    }
}

/// A row of a lens for the same corner of sixteen triangles.
#[inline(always)]
fn row<S: Simd>(simd: S, row: [f32; 4], corner: &[Lanes; 3]) -> f32x16<S> {
    let xy = fma(splat(simd, row[1]), corner[1].load(simd), splat(simd, row[3]));
    let z = fma(splat(simd, row[2]), corner[2].load(simd), xy);
    fma(splat(simd, row[0]), corner[0].load(simd), z)
}

/// A line of a triangle at sixteen places.
#[inline(always)]
fn line<S: Simd>(simd: S, flat: &Flat, edge: usize, x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
    fma(splat(simd, flat.ex[edge]), x, fma(splat(simd, flat.ey[edge]), y, splat(simd, flat.e[edge])))
}

/// The long way for a triangle that reaches behind the lens, or has more digits than a mesh: in `f64`, with lines from
/// the cross products of (a, b, g), which need no division. `None` if it has no area in the picture, or lies beside it.
pub(super) fn flat_exact(parallel: bool, corners: [DVec3; 3], rays: &Rays) -> Option<Flat> {
    // z g at the corners, with g = 1 for parallel rays.
    let closeness = corners.map(|corner| if parallel { -corner.z } else { 1.0 });
    let [a, b, c] = corners.map(|corner| if parallel { corner.with_z(1.0) } else { corner });
    let normals = [b.cross(c), c.cross(a), a.cross(b)];
    let determinant = a.dot(normals[0]);
    let scale = normals.iter().map(|n| n.abs().max_element()).fold(0.0, f64::max);
    if determinant == 0.0 || scale == 0.0 || !scale.is_finite() {
        // Edge-on, to the last digit: no ray hits it.
        return None;
    }
    let reach = rays.reach();
    let size = |[e, ex, ey]: [f32; 3]| e.abs() + reach * (ex.abs() + ey.abs());
    let lines = normals.map(|n| n * (determinant.signum() / scale));
    let z = (normals[0] * closeness[0] + normals[1] * closeness[1] + normals[2] * closeness[2]) / determinant;
    let [zx, zy, z0] = z.as_vec3().to_array();
    let mut flat = Flat {
        e: [0.0; 3],
        ex: [0.0; 3],
        ey: [0.0; 3],
        slack: [0.0; 3],
        z: [z0, zx, zy],
        z_error: 4.0 * ROUNDING * size([z0, zx, zy]) + (zx.abs() + zy.abs()) * rays.error,
        around: rays.union,
        z_most: f32::INFINITY,
        large: true,
    };
    for (edge, line) in lines.into_iter().enumerate() {
        let [ex, ey, e] = line.as_vec3().to_array();
        let error = 4.0 * ROUNDING * size([e, ex, ey]) + (ex.abs() + ey.abs()) * rays.error;
        (flat.e[edge], flat.ex[edge], flat.ey[edge], flat.slack[edge]) = (e + error, ex, ey, 2.0 * error);
    }
    let [x_lo, x_hi, y_lo, y_hi] = rays.union;
    let beside = |edge: usize| {
        let x = if flat.ex[edge] > 0.0 { x_hi } else { x_lo };
        let y = if flat.ey[edge] > 0.0 { y_hi } else { y_lo };
        flat.e[edge] + flat.ex[edge] * x + flat.ey[edge] * y < 0.0
    };
    (!(beside(0) || beside(1) || beside(2))).then_some(flat)
}

/// Corners of a mesh's triangle, seen through a lens.
pub(super) fn through(lens: &Lens, corners: [Vec3; 3]) -> [DVec3; 3] {
    corners.map(|corner| lens.exact(corner))
}

impl Flat {
    /// Which blocks of the tile it may touch.
    #[inline(always)]
    pub(super) fn blocks_touched<S: Simd>(&self, simd: S, rays: &Rays) -> u32 {
        let mut touched = rays.blocks_in(simd, self.around);
        if self.large {
            let [x_lo, x_hi, y_lo, y_hi] = &rays.bounds;
            for edge in 0..3 {
                let x = if self.ex[edge] > 0.0 { x_hi } else { x_lo };
                let y = if self.ey[edge] > 0.0 { y_hi } else { y_lo };
                let most = line(simd, self, edge, x.load(simd), y.load(simd));
                touched &= bits(most.simd_ge(splat(simd, 0.0)));
            }
        }
        touched
    }
}

/// The lines and the closeness of a triangle at the rays of a block.
pub(super) struct At<S: Simd> {
    /// Inside, or too close to a line to tell.
    pub maybe: u32,
    /// Inside for certain.
    pub certain: u32,
    pub z: f32x16<S>,
}

/// Evaluates a triangle at the rays of a block.
#[inline(always)]
pub(super) fn at<S: Simd>(simd: S, flat: &Flat, x: f32x16<S>, y: f32x16<S>) -> Option<At<S>> {
    let lines = three!(edge => line(simd, flat, edge, x, y));
    let zero = splat(simd, 0.0);
    let least = lines[0].min(lines[1]).min(lines[2]);
    let maybe = bits(least.simd_ge(zero));
    if maybe == 0 {
        return None;
    }
    let sure = three!(edge => lines[edge] - splat(simd, flat.slack[edge]));
    let certain = bits(sure[0].min(sure[1]).min(sure[2]).simd_gt(zero));
    let z = fma(splat(simd, flat.z[1]), x, fma(splat(simd, flat.z[2]), y, splat(simd, flat.z[0])));
    Some(At { maybe, certain, z })
}
