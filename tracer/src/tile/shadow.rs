//! What lies between a light and each point of a tile.
//!
//! Rays from a point light to the points start in one point again: they are a tile with an uneven grid. So are the
//! parallel rays of a directional light, which start in one point infinitely far away. A point is dark as
//! soon as one triangle is certain to be before it.

use glam::{DVec3, Vec3};

use super::cover::{Question, cover_any_order, cover_set_up};
use super::lens::{Affine, Lens, ROUNDING};
use super::setup::{At, Flats};
use super::visible::NOTHING;
use super::walk::{Frontier, Interest};
use super::{ALL_BLOCKS, BLOCKS, Rays, Scratch};
use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::simd::vector::Vec3x16;
use crate::simd::{
    Indices, Lanes, Simd, SimdBase, bits, each_bit, f32x16, fma, mask_of, select, splat, three, u32x16,
};
use crate::trace::{PrimitiveId, Ray};

/// Points farther from the axis of the light's picture than this are asked one by one.
const WIDEST: f64 = 8.0;

/// A triangle this many times closer to the light than a point lies before `t_light` for certain: half of what that allows.
const BEFORE_LIGHT: f32 = (1 << 17) as f32;

/// Boxes that touch no more blocks than this are held against single rays.
const FEW_BLOCKS: u32 = 8;

/// No more triangles than this are held against a block of rays without counting its rays first.
const FEW_TRIANGLES: u32 = 3;

/// The axes of the light's picture follow the tile's, unless the sine of the angle between those is less than this.
const LEAST_SINE: f64 = 0.125;

/// Where shadow rays go.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Source {
    /// To a point.
    Point(DVec3),
    /// Along this direction.
    Parallel(DVec3),
}

/// Points of a tile, and the light that they are asked about.
pub(crate) struct ShadowTile<'a> {
    pub frame: &'a PreparedFrame,
    /// The light, in eye space.
    pub light: Source,
    /// Share of the way to the light on which things are in its way.
    pub t_light: f64,
    /// Where the points stand in the picture of the eye.
    pub grid: &'a Rays,
    /// Points in eye space, indexed `[block][axis]`.
    pub points: &'a [[Lanes; 3]; BLOCKS],
    /// What each point lies on.
    pub item: &'a [Indices; BLOCKS],
    pub triangle: &'a [Indices; BLOCKS],
}

/// Points as the light sees them.
pub(super) struct Points {
    /// Those that are not known to be dark yet.
    open: [u32; BLOCKS],
    dark: [u32; BLOCKS],
    /// Closeness of the points to the light lies between these.
    low: [Lanes; BLOCKS],
    high: [Lanes; BLOCKS],
    /// Least of `low` in each block; infinity where no point is open.
    least: Lanes,
    /// Least of `least`.
    least_of_all: f32,
}

impl Points {
    pub(super) const NONE: Points = Points {
        open: [0; BLOCKS],
        dark: [0; BLOCKS],
        low: [Lanes::ZERO; BLOCKS],
        high: [Lanes::ZERO; BLOCKS],
        least: Lanes::ZERO,
        least_of_all: 0.0,
    };
}

impl ShadowTile<'_> {
    /// Which of the points in `asked` are dark.
    #[inline(always)]
    pub(crate) fn dark<S: Simd>(
        &self,
        simd: S,
        asked: [u32; BLOCKS],
        scratch: &mut Scratch,
    ) -> [u32; BLOCKS] {
        let Scratch { scene_frontier, mesh_frontier, flats, shadow_rays: rays, shadow: points, .. } = scratch;
        points.open = asked;
        points.dark = [0; BLOCKS];
        let extent = self.extent(simd, &asked);
        let Some(lens) = self.lens(&extent) else {
            Blocked { tile: self, rays, points, item: NOTHING }.ask_all();
            return points.dark;
        };
        points.project(simd, self.points, &extent, &lens, rays);
        let mut blocked = Blocked { tile: self, rays, points, item: NOTHING };
        scene_frontier.find(simd, &self.frame.nodes, &lens, rays, &blocked);
        for leaf in &scene_frontier.leaves {
            if leaf.z_most < blocked.points.least_of_all {
                continue;
            }
            for &item in self.frame.items_of(leaf.index) {
                blocked.item = item;
                blocked.cover_item(simd, &lens, mesh_frontier, flats);
            }
        }
        for plane in 0..self.frame.planes.len() as u32 {
            blocked.item = self.frame.items.first_plane() + plane;
            blocked.ask_item();
        }
        points.dark
    }

    fn point(&self, block: usize, lane: usize) -> Vec3 {
        Vec3::from_array(three!(axis => self.points[block][axis].0[lane]))
    }

    /// A lens at the light, towards the middle of the points; `None` if they stand too far apart, or at the light.
    fn lens(&self, extent: &Extent) -> Option<Lens> {
        let &Extent { lo, hi, across, along } = extent;
        let middle = extent.middle().as_dvec3();
        let reach = f64::from(lo.abs().max(hi.abs()).max_element());
        // The picture of a lens at `from`.
        let towards = |axis: DVec3, from: DVec3| {
            let (u, v) = picture_axes(axis, across, along);
            let rows = [u, v, axis];
            Affine(three!(i => rows[i].extend(-rows[i].dot(from)).to_array()))
        };
        match self.light {
            Source::Parallel(to_light) => Some(Lens::new(towards(-to_light, middle), reach, true)),
            Source::Point(light) => {
                let axis = middle - light;
                // The ball around the points, seen from the light, must not reach far to its sides.
                let least = (hi - lo).as_dvec3() * (0.5 * (1.0 + 1.0 / WIDEST));
                let sees = axis.length_squared() > least.length_squared();
                sees.then(|| Lens::new(towards(near_one(axis), light), reach, false))
            }
        }
    }

    #[inline(always)]
    fn extent<S: Simd>(&self, simd: S, asked: &[u32; BLOCKS]) -> Extent {
        let zero = splat(simd, 0.0);
        let mut lo = Vec3x16::splat(simd, [f32::INFINITY; 3]);
        let mut hi = Vec3x16::splat(simd, [f32::NEG_INFINITY; 3]);
        let mut sums = [Vec3x16::splat(simd, [0.0; 3]); 3];
        let mut weights = [zero; 3];
        for block in 0..BLOCKS {
            if asked[block] == 0 {
                continue;
            }
            let mask = mask_of(simd, asked[block]);
            let p = Vec3x16::load(simd, &self.points[block]);
            let one = select(mask, splat(simd, 1.0), zero);
            let weight = [one, one * self.grid.x[block].load(simd), one * self.grid.y[block].load(simd)];
            for axis in 0..3 {
                let at = select(mask, p.0[axis], zero);
                lo.0[axis] = select(mask, lo.0[axis].min(at), lo.0[axis]);
                hi.0[axis] = select(mask, hi.0[axis].max(at), hi.0[axis]);
                for i in 0..3 {
                    sums[i].0[axis] = fma(weight[i], at, sums[i].0[axis]);
                }
            }
            for i in 0..3 {
                weights[i] = weights[i] + weight[i];
            }
        }
        let sum = three!(i => DVec3::from_array(three!(axis => f64::from(sums[i].0[axis].reduce_sum()))));
        let weight = three!(i => f64::from(weights[i].reduce_sum()));
        Extent {
            lo: Vec3::from_array(three!(axis => lo.0[axis].reduce_min())),
            hi: Vec3::from_array(three!(axis => hi.0[axis].reduce_max())),
            across: sum[1] - sum[0] * (weight[1] / weight[0]),
            along: sum[2] - sum[0] * (weight[2] / weight[0]),
        }
    }

    fn ray(&self, block: usize, lane: usize) -> (Ray, PrimitiveId) {
        let origin = self.point(block, lane).as_dvec3();
        let leaving = PrimitiveId { item: self.item[block].0[lane], triangle: self.triangle[block].0[lane] };
        let direction = match self.light {
            Source::Point(light) => light - origin,
            Source::Parallel(to_light) => to_light,
        };
        (Ray { origin, direction }, leaving)
    }
}

/// The points that are asked about.
struct Extent {
    lo: Vec3,
    hi: Vec3,
    /// Where they go, by and large, along the rows and the columns of the tile; of any length.
    across: DVec3,
    along: DVec3,
}

impl Extent {
    fn middle(&self) -> Vec3 {
        (self.lo + self.hi) * 0.5
    }

    /// Largest distance of a point from `place` on each axis.
    fn reach_from(&self, place: Vec3) -> DVec3 {
        (self.hi - place).max(place - self.lo).as_dvec3()
    }
}

/// Rows of a lens for its picture: perpendicular to `axis`, and such that going `along` changes nothing in the first and
/// going `across` nothing in the second. Blocks of rays then fill their rectangles. Any length serves, so nothing is
/// normalised: a square root is long to wait for.
fn picture_axes(axis: DVec3, across: DVec3, along: DVec3) -> (DVec3, DVec3) {
    let (across, along) = (near_one(across), near_one(along));
    let (u, v) = (along.cross(axis), axis.cross(across));
    let (uu, vv) = (u.length_squared(), v.length_squared());
    let volume = across.cross(along).dot(axis);
    // The sine of the angle between the two, as seen from the light, squared; times the lengths.
    if volume * volume * axis.length_squared() > LEAST_SINE * LEAST_SINE * uu * vv {
        return (near_one(u), near_one(v));
    }
    let longer = if uu > vv { near_one(u) } else { near_one(v) };
    if longer.length_squared() > 0.25 {
        (longer, axis.cross(longer))
    } else {
        axis.normalize().any_orthonormal_pair()
    }
}

/// Times a power of two, so that the largest component is in [1, 2). Zero stays zero.
fn near_one(vector: DVec3) -> DVec3 {
    let exponent = vector.abs().max_element().to_bits() & (0x7ff << 52);
    vector * f64::from_bits((2046_u64 << 52).saturating_sub(exponent))
}

impl Points {
    /// Where the light sees the points.
    #[inline(always)]
    fn project<S: Simd>(
        &mut self,
        simd: S,
        points: &[[Lanes; 3]; BLOCKS],
        extent: &Extent,
        lens: &Lens,
        rays: &mut Rays,
    ) {
        let middle = extent.middle();
        let lens = &lens.relative_to(middle.as_dvec3(), extent.reach_from(middle));
        let middle = Vec3x16::splat(simd, middle.to_array());
        let infinite = splat(simd, f32::INFINITY);
        let mut nearest = infinite;
        for block in 0..BLOCKS {
            self.least.0[block] = f32::INFINITY;
            if self.open[block] == 0 {
                continue;
            }
            let p = Vec3x16::load(simd, &points[block]).sub(middle);
            let [a, b, g] = three!(i => {
                let row = three!(axis => splat(simd, lens.rows[i][axis]));
                let constant = splat(simd, lens.rows[i][3]);
                fma(row[0], p.0[0], fma(row[1], p.0[1], fma(row[2], p.0[2], constant)))
            });
            let one = splat(simd, 1.0);
            let scale = if lens.parallel { one } else { one / g };
            let closeness = if lens.parallel { -g } else { scale };
            rays.x[block].store(a * scale);
            rays.y[block].store(b * scale);
            let error = scale * scale * splat(simd, 2.0 * lens.error[1])
                + closeness.abs() * splat(simd, 4.0 * ROUNDING);
            let low = closeness - error;
            self.low[block].store(low);
            self.high[block].store(closeness + error);
            let open = mask_of(simd, self.open[block]);
            nearest = nearest.min(select(open, g, infinite));
            self.least.0[block] = select(open, low, infinite).reduce_min();
        }
        self.least_of_all = self.least.load(simd).reduce_min();
        rays.bound(simd, &self.open);
        let reach = rays.reach();
        let by_lens = if lens.parallel {
            lens.error[0]
        } else {
            (lens.error[0] + reach * lens.error[1]) / nearest.reduce_min()
        };
        rays.widen(simd, 2.0 * by_lens + 4.0 * ROUNDING * reach);
    }

    fn darken(&mut self, block: usize, lanes: u32) {
        self.dark[block] |= lanes;
        self.open[block] &= !lanes;
        if self.open[block] == 0 && self.least.0[block] < f32::INFINITY {
            self.least.0[block] = f32::INFINITY;
            self.least_of_all =
                self.least.0.iter().fold(f32::INFINITY, |least, &of_block| least.min(of_block));
        }
    }

    /// Open points of a block at most as close to the light as `z_most`.
    #[inline(always)]
    fn open_before<S: Simd>(&self, simd: S, block: usize, z_most: f32) -> u32 {
        self.open[block] & bits(self.low[block].load(simd).simd_le(splat(simd, z_most)))
    }
}

/// Asks whether anything is before the points.
struct Blocked<'a> {
    tile: &'a ShadowTile<'a>,
    rays: &'a Rays,
    points: &'a mut Points,
    item: u32,
}

impl Blocked<'_> {
    #[inline(always)]
    fn cover_item<S: Simd>(&mut self, simd: S, lens: &Lens, frontier: &mut Frontier, flats: &mut Flats) {
        match self.tile.frame.items.get(self.item) {
            Item::Model(index) => {
                let instance = &self.tile.frame.instances[index];
                let mesh_lens = lens.of(&instance.placement, 1.0);
                cover_any_order(simd, &instance.mesh, &mesh_lens, self.rays, frontier, flats, self);
            }
            Item::Triangle(index) => {
                let corners = self.tile.frame.triangles[index].corners;
                let corners = three!(k => lens.exact(corners[k]));
                flats.set_up_exactly(0, lens.parallel, corners, self.rays);
                cover_set_up(simd, flats, 0, ALL_BLOCKS, self);
            }
            Item::Sphere(_) => self.ask_item(),
        }
    }

    /// One item, exactly, for every open point.
    fn ask_item(&mut self) {
        for block in 0..BLOCKS {
            for lane in each_bit(self.points.open[block]) {
                self.ask(block, lane, 0);
            }
        }
    }

    /// The whole scene for every point, ray by ray.
    fn ask_all(&mut self) {
        for block in 0..BLOCKS {
            for lane in each_bit(self.points.open[block]) {
                let (ray, leaving) = self.tile.ray(block, lane);
                if self.tile.frame.occluded(&ray, self.tile.t_light, leaving) {
                    self.points.dark[block] |= 1 << lane;
                }
            }
        }
    }

    /// Whether a primitive is before a point, to the last digit.
    #[inline(never)]
    fn ask(&mut self, block: usize, lane: usize, triangle: u32) {
        let (ray, leaving) = self.tile.ray(block, lane);
        let primitive = PrimitiveId { item: self.item, triangle };
        let hit = self.tile.frame.hit_of(&ray, primitive, Some(leaving));
        if hit.is_some_and(|hit| hit.t < self.tile.t_light) {
            self.points.darken(block, 1 << lane);
        }
    }

    /// Some triangles against one block of rays.
    #[inline(always)]
    fn cover_block<S: Simd>(&mut self, simd: S, flats: &Flats, first: u32, triangles: u32, block: usize) {
        let (x, y) = (self.rays.x[block].load(simd), self.rays.y[block].load(simd));
        let (low, high) = (self.points.low[block].load(simd), self.points.high[block].load(simd));
        let own_item = self.tile.item[block].equal(simd, self.item);
        let own_triangle = self.tile.triangle[block].load(simd);
        for lane in each_bit(triangles) {
            let triangle = first + lane as u32;
            let at = flats.triangle_at(simd, lane, x, y);
            let (maybe, certain) = self.before(simd, &at, splat(simd, flats.z_error.0[lane]), low, high);
            // Points do not hide behind the very triangle that they lie on.
            let own = own_item & bits(own_triangle.simd_eq(u32x16::splat(simd, triangle)));
            let maybe = maybe & self.points.open[block] & !own;
            if maybe == 0 {
                continue;
            }
            self.points.darken(block, maybe & certain);
            for ray in each_bit(maybe & !certain) {
                self.ask(block, ray, triangle);
            }
        }
    }

    /// One ray against all triangles of a leaf.
    #[inline(always)]
    fn cover_ray<S: Simd>(&mut self, simd: S, flats: &Flats, first: u32, block: usize, lane: usize) {
        let (x, y) = (self.rays.x[block].0[lane], self.rays.y[block].0[lane]);
        let at = flats.all_at(simd, x, y);
        let error = flats.z_error.load(simd);
        let low = splat(simd, self.points.low[block].0[lane]);
        let high = splat(simd, self.points.high[block].0[lane]);
        let (maybe, certain) = self.before(simd, &at, error, low, high);
        let mut maybe = maybe & flats.seen;
        if self.tile.item[block].0[lane] == self.item {
            let own = self.tile.triangle[block].0[lane].wrapping_sub(first);
            maybe &= !1_u32.checked_shl(own).unwrap_or(0);
        }
        if maybe & certain != 0 {
            return self.points.darken(block, 1 << lane);
        }
        for triangle in each_bit(maybe) {
            self.ask(block, lane, first + triangle as u32);
            if self.points.open[block] >> lane & 1 == 0 {
                return;
            }
        }
    }

    /// Where a triangle may be, and where it certainly is, between the light and points with a closeness of `low` to `high`.
    #[inline(always)]
    fn before<S: Simd>(
        &self,
        simd: S,
        at: &At<S>,
        error: f32x16<S>,
        low: f32x16<S>,
        high: f32x16<S>,
    ) -> (u32, u32) {
        let (z_low, z_high) = (at.z - error, at.z + error);
        let maybe = at.maybe & !bits(z_high.simd_lt(low));
        let mut certain = at.certain & bits(z_low.simd_gt(high));
        if self.tile.t_light.is_finite() {
            // What is next to the light itself is for the exact test to tell from the light.
            certain &= bits(z_high.simd_lt(low * splat(simd, BEFORE_LIGHT)));
        }
        (maybe, certain)
    }
}

impl<S: Simd> Interest<S> for Blocked<'_> {
    const ON_GRID: bool = false;

    fn least(&self) -> &Lanes {
        &self.points.least
    }

    fn least_closeness(&self) -> f32 {
        self.points.least_of_all
    }

    #[inline(always)]
    fn refine(&self, simd: S, around: [f32; 4], z_most: f32, blocks: u32) -> u32 {
        if blocks.count_ones() > FEW_BLOCKS {
            return blocks;
        }
        // A small box: it may well stand between the rays.
        let error = self.rays.error;
        let around = [around[0] - error, around[1] + error, around[2] - error, around[3] + error];
        let mut wanted = 0;
        for block in each_bit(blocks) {
            let rays = self.rays.rays_in(simd, block, around) & self.points.open_before(simd, block, z_most);
            wanted |= u32::from(rays != 0) << block;
        }
        wanted
    }
}

impl<S: Simd> Question<S> for Blocked<'_> {
    /// Block by block, and in each what takes fewer steps: triangle by triangle, or ray by ray.
    #[inline(always)]
    fn cover(&mut self, simd: S, flats: &Flats, first: u32, blocks: u32) {
        let mut hull = None;
        for block in each_bit(blocks) {
            let triangles = flats.touching(simd, self.rays.around(block), self.points.least.0[block]);
            if triangles.count_ones() <= FEW_TRIANGLES {
                self.cover_block(simd, flats, first, triangles, block);
                continue;
            }
            if hull.is_none() {
                hull = Some(flats.hull(simd));
            }
            let Some((around, z_most)) = hull else { continue };
            let rays = self.rays.rays_in(simd, block, around) & self.points.open_before(simd, block, z_most);
            if rays.count_ones() < triangles.count_ones() {
                for lane in each_bit(rays) {
                    self.cover_ray(simd, flats, first, block, lane);
                }
            } else {
                self.cover_block(simd, flats, first, triangles, block);
            }
        }
    }
}
