//! What lies between a light and each point of a tile.
//!
//! Rays from a point light to the points start in one point again: they are a tile with an uneven grid. So are the
//! parallel rays of a directional light, which start in one point infinitely far away. A point is dark as
//! soon as one triangle is certain to be before it.

use glam::{DMat3, DVec3, Vec3};

use super::cover::{Question, cover_flat, cover_mesh};
use super::lens::{Frustum, Lens, ROUNDING};
use super::setup::{At, Flat, at, flat_exact};
use super::visible::depth_in_sight;
use super::walk::Interest;
use super::{BLOCKS, Rays};
use crate::bvh::Child;
use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::simd::{LANES, Lanes, Simd, SimdBase, bits, each_bit, equal, splat, three};
use crate::trace::{PrimitiveId, Ray};

/// Points farther from the axis of the light's picture than this are asked one by one.
const WIDEST: f32 = 8.0;

/// A triangle this many times closer to the light than a point lies before `t_light` for certain: half of what that allows.
const BEFORE_LIGHT: f32 = (1 << 17) as f32;

/// Boxes that touch no more blocks than this are held against single rays.
const FEW: u32 = 4;

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
    /// Points in eye space, indexed `[axis][block]`.
    pub points: &'a [[Lanes; BLOCKS]; 3],
    /// What each point lies on.
    pub item: &'a [[u32; LANES]; BLOCKS],
    pub triangle: &'a [[u32; LANES]; BLOCKS],
}

impl ShadowTile<'_> {
    /// Which of the points in `asked` are dark.
    #[inline(always)]
    pub(crate) fn dark<S: Simd>(&self, simd: S, asked: [u32; BLOCKS]) -> [u32; BLOCKS] {
        let mut blocked = Blocked {
            tile: self,
            item: 0,
            open: asked,
            dark: [0; BLOCKS],
            low: [Lanes::ZERO; BLOCKS],
            high: [Lanes::ZERO; BLOCKS],
            least: Lanes([f32::INFINITY; LANES]),
            rays: Rays::empty(),
        };
        let Some(lens) = self.lens(&asked) else {
            blocked.ask_all();
            return blocked.dark;
        };
        blocked.project(simd, &lens);
        let rays = blocked.rays.clone();
        let frustum = Frustum::new(&lens, rays.union);
        let mut pending = vec![0_u32];
        while let Some(index) = pending.pop() {
            let node = &self.frame.nodes[index as usize];
            for side in 0..2 {
                let Some(depth) = depth_in_sight(&frustum, node.child_bounds(side)) else { continue };
                if lens.z_most(depth) < blocked.least_of_all() {
                    continue;
                }
                match node.child(side) {
                    Child::Empty => {}
                    Child::Inner(inner) => pending.push(inner),
                    Child::Leaf { first, count } => {
                        for position in first..first + count {
                            blocked.cover_item(simd, self.frame.item_at(position), &lens, &rays);
                        }
                    }
                }
            }
        }
        for plane in 0..self.frame.planes.len() as u32 {
            blocked.item = self.frame.items.first_plane() + plane;
            blocked.ask_item();
        }
        blocked.dark
    }

    fn point(&self, block: usize, lane: usize) -> Vec3 {
        Vec3::from_array([0, 1, 2].map(|axis| self.points[axis][block].0[lane]))
    }

    /// A lens at the light, towards the middle of the points; `None` if they stand too far apart, or at the light.
    fn lens(&self, asked: &[u32; BLOCKS]) -> Option<Lens> {
        let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for block in 0..BLOCKS {
            for lane in each_bit(asked[block]) {
                lo = lo.min(self.point(block, lane));
                hi = hi.max(self.point(block, lane));
            }
        }
        let middle = (lo.as_dvec3() + hi.as_dvec3()) * 0.5;
        let reach = f64::from(lo.abs().max(hi.abs()).max_element());
        let along = |axis: DVec3| {
            let (u, v) = axis.any_orthonormal_pair();
            DMat3::from_cols(u, v, axis).transpose()
        };
        match self.light {
            Source::Parallel(to_light) => {
                let linear = along(-to_light);
                Some(Lens::parallel(linear, -(linear * middle), reach))
            }
            Source::Point(light) => {
                let linear = along((middle - light).try_normalize()?);
                // The ball around the points, seen from the light, must not reach far to its sides.
                let half = (hi - lo).as_dvec3().length() * 0.5;
                let sees = (middle - light).length() > half * (1.0 + 1.0 / f64::from(WIDEST));
                sees.then(|| Lens::new(linear, -(linear * light), reach))
            }
        }
    }

    fn ray(&self, block: usize, lane: usize) -> (Ray, PrimitiveId) {
        let origin = self.point(block, lane).as_dvec3();
        let leaving = PrimitiveId { item: self.item[block][lane], triangle: self.triangle[block][lane] };
        let direction = match self.light {
            Source::Point(light) => light - origin,
            Source::Parallel(to_light) => to_light,
        };
        (Ray { origin, direction }, leaving)
    }
}

/// Asks whether anything is before the points.
struct Blocked<'a> {
    tile: &'a ShadowTile<'a>,
    item: u32,
    /// Points that are not known to be dark yet.
    open: [u32; BLOCKS],
    dark: [u32; BLOCKS],
    /// Closeness of the points to the light lies between these.
    low: [Lanes; BLOCKS],
    high: [Lanes; BLOCKS],
    /// Least of `low` in each block; infinity where no point is open.
    least: Lanes,
    rays: Rays,
}

impl Blocked<'_> {
    /// Where the light sees the points.
    #[inline(always)]
    fn project<S: Simd>(&mut self, simd: S, lens: &Lens) {
        let mut nearest = f32::INFINITY;
        for block in 0..BLOCKS {
            let p = three!(axis => self.tile.points[axis][block].load(simd));
            let [a, b, g] = three!(i => {
                let [x, y, z, c] = lens.rows[i];
                splat(simd, x) * p[0] + splat(simd, y) * p[1] + splat(simd, z) * p[2] + splat(simd, c)
            });
            let one = splat(simd, 1.0);
            let scale = if lens.parallel { one } else { one / g };
            let closeness = if lens.parallel { -g } else { scale };
            self.rays.x[block].store(a * scale);
            self.rays.y[block].store(b * scale);
            let error = scale * scale * splat(simd, 2.0 * lens.error[1])
                + closeness.abs() * splat(simd, 4.0 * ROUNDING);
            self.low[block].store(closeness - error);
            self.high[block].store(closeness + error);
            for lane in each_bit(self.open[block]) {
                nearest = nearest.min(g[lane]);
                self.least.0[block] = self.least.0[block].min(self.low[block].0[lane]);
            }
        }
        let blocks =
            (0..BLOCKS).filter(|&block| self.open[block] != 0).fold(0, |bits, block| bits | 1 << block);
        self.rays.bound(self.open, blocks);
        let reach = self.rays.reach();
        let by_lens =
            if lens.parallel { lens.error[0] } else { (lens.error[0] + reach * lens.error[1]) / nearest };
        self.rays.error = 2.0 * by_lens + 4.0 * ROUNDING * reach;
        for side in 0..4 {
            let out = if side % 2 == 0 { -self.rays.error } else { self.rays.error };
            self.rays.union[side] += out;
            self.rays.bounds[side].0.iter_mut().for_each(|bound| *bound += out);
        }
    }

    fn least_of_all(&self) -> f32 {
        self.least.0.iter().fold(f32::INFINITY, |least, &of_block| least.min(of_block))
    }

    #[inline(always)]
    fn cover_item<S: Simd>(&mut self, simd: S, item: u32, lens: &Lens, rays: &Rays) {
        self.item = item;
        match self.tile.frame.items.get(item) {
            Item::Model(index) => {
                let instance = &self.tile.frame.instances[index];
                let mesh_lens = lens.of(instance.linear, instance.translation, 1.0);
                cover_mesh(simd, &instance.mesh, &mesh_lens, rays, self);
            }
            Item::Triangle(index) => {
                let corners = self.tile.frame.triangles[index].corners.map(|p| lens.exact_point(p));
                if let Some(flat) = flat_exact(lens.parallel, corners, rays) {
                    cover_flat(simd, &flat, 0, rays, self);
                }
            }
            Item::Sphere(_) => self.ask_item(),
        }
    }

    /// One item, exactly, for every open point.
    fn ask_item(&mut self) {
        for block in 0..BLOCKS {
            for lane in each_bit(self.open[block]) {
                self.ask(block, lane, 0);
            }
        }
    }

    /// The whole scene for every point, ray by ray.
    fn ask_all(&mut self) {
        for block in 0..BLOCKS {
            for lane in each_bit(self.open[block]) {
                let (ray, leaving) = self.tile.ray(block, lane);
                if self.tile.frame.occluded(&ray, self.tile.t_light, leaving) {
                    self.dark[block] |= 1 << lane;
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
            self.darken(block, 1 << lane);
        }
    }

    fn darken(&mut self, block: usize, lanes: u32) {
        self.dark[block] |= lanes;
        self.open[block] &= !lanes;
        if self.open[block] == 0 {
            self.least.0[block] = f32::INFINITY;
        }
    }

    /// Points of a block that do not lie on this very triangle.
    #[inline(always)]
    fn others<S: Simd>(&self, simd: S, block: usize, triangle: u32) -> u32 {
        let own_item = equal(simd, &self.tile.item[block], self.item);
        !(own_item & equal(simd, &self.tile.triangle[block], triangle))
    }

    /// Blocks with an open point at most as close to the light as `z_most`.
    #[inline(always)]
    fn open_blocks<S: Simd>(&self, simd: S, z_most: f32) -> u32 {
        bits(self.least.load(simd).simd_le(splat(simd, z_most)))
    }
}

impl<S: Simd> Interest<S> for Blocked<'_> {
    #[inline(always)]
    fn wants(&self, simd: S, around: [f32; 4], z_most: f32) -> bool {
        let error = self.rays.error;
        let around = [around[0] - error, around[1] + error, around[2] - error, around[3] + error];
        let blocks = self.rays.blocks_in(simd, around) & self.open_blocks(simd, z_most);
        if blocks.count_ones() > FEW {
            return true;
        }
        // A small box: it may well stand between the rays.
        for block in each_bit(blocks) {
            let before = bits(self.low[block].load(simd).simd_le(splat(simd, z_most)));
            if self.rays.rays_in(simd, block, around) & self.open[block] & before != 0 {
                return true;
            }
        }
        false
    }
}

impl<S: Simd> Question<S> for Blocked<'_> {
    const ON_GRID: bool = false;

    fn least_closeness(&self) -> f32 {
        self.least_of_all()
    }

    #[inline(always)]
    fn open_blocks(&self, simd: S, z_most: f32) -> u32 {
        self.open_blocks(simd, z_most)
    }

    #[inline(always)]
    fn cover(&mut self, simd: S, flat: &Flat, triangle: u32, block: usize) {
        let Some(At { maybe, certain, z }) =
            at(simd, flat, self.rays.x[block].load(simd), self.rays.y[block].load(simd))
        else {
            return;
        };
        let error = splat(simd, flat.z_error);
        let low = self.low[block].load(simd);
        let maybe = maybe & !bits((z + error).simd_lt(low)) & self.open[block];
        if maybe == 0 {
            return;
        }
        let maybe = maybe & self.others(simd, block, triangle);
        let mut certain = maybe & certain & bits((z - error).simd_gt(self.high[block].load(simd)));
        if self.tile.t_light.is_finite() {
            // What is next to the light itself is for the exact test to tell from the light.
            certain &= bits((z + error).simd_lt(low * splat(simd, BEFORE_LIGHT)));
        }
        self.darken(block, certain);
        for lane in each_bit(maybe & !certain) {
            self.ask(block, lane, triangle);
        }
    }

    fn settle(&mut self, _: S) {}
}
