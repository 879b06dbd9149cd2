//! Boxes and triangles between a light and the points of a tile.

use super::cover::{Question, cover_any_order, cover_set_up};
use super::lens::Lens;
use super::points::Points;
use super::setup::{At, Flats};
use super::shadow::ShadowTile;
use super::visible::NOTHING;
use super::walk::{Frontier, Interest};
use super::{ALL_BLOCKS, BLOCKS, Rays};
use crate::compile::Item;
use crate::cutout;
use crate::simd::{Lanes, Simd, SimdBase, bits, each_bit, f32x16, splat, u32x16};
use crate::trace::PrimitiveId;

/// A triangle this many times closer to the light than a point lies before `t_light` for certain: half of what that allows.
const BEFORE_LIGHT: f32 = (1 << 17) as f32;

/// Boxes that touch no more blocks than this are held against single rays.
const FEW_BLOCKS: u32 = 8;

/// No more triangles than this are held against a block of rays without counting its rays first.
const FEW_TRIANGLES: u32 = 3;

/// Asks whether anything is before the points.
pub(super) struct Blocked<'a> {
    pub tile: &'a ShadowTile<'a>,
    pub rays: &'a Rays,
    pub points: &'a mut Points,
    /// Whose triangles are asked about.
    item: u32,
    /// Which of them can be cut out.
    cutouts: &'a [u16],
}

impl<'a> Blocked<'a> {
    /// About nothing yet.
    pub(super) fn new(tile: &'a ShadowTile<'a>, rays: &'a Rays, points: &'a mut Points) -> Self {
        Self { tile, rays, points, item: NOTHING, cutouts: &[] }
    }

    /// Asks about this item from now on.
    #[inline(always)]
    pub(super) fn turn_to(&mut self, item: u32) {
        self.item = item;
        self.cutouts = self.tile.frame.cutouts_of(item);
    }

    #[inline(always)]
    pub(super) fn cover_item<S: Simd>(
        &mut self,
        simd: S,
        lens: &Lens,
        frontier: &mut Frontier,
        flats: &mut Flats,
    ) {
        match self.tile.frame.items.get(self.item) {
            Item::Model(index) => {
                let instance = &self.tile.frame.instances[index];
                let mesh_lens = lens.of(&instance.placement, 1.0);
                cover_any_order(simd, &instance.mesh, &mesh_lens, self.rays, frontier, flats, self);
            }
            Item::Triangle(index) => {
                let corners = self.tile.frame.triangles[index].corners;
                flats.set_up_exactly(0, lens, corners, self.rays);
                cover_set_up(simd, flats, 0, ALL_BLOCKS, self);
            }
            Item::Sphere(_) => self.ask_item(),
        }
    }

    /// One item, exactly, for every open point.
    pub(super) fn ask_item(&mut self) {
        for block in 0..BLOCKS {
            for lane in each_bit(self.points.open[block]) {
                self.ask(block, lane, 0);
            }
        }
    }

    /// The whole scene for every point, ray by ray.
    pub(super) fn ask_all(&mut self) {
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

    /// As [`Blocked::cover_block`] for triangles that can be cut out: each ray that one may be before is asked exactly.
    #[cold]
    #[inline(never)]
    fn cover_cut<S: Simd>(&mut self, simd: S, flats: &Flats, first: u32, triangles: u32, block: usize) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (x, y) = (self.rays.x[block].load(simd), self.rays.y[block].load(simd));
                let (low, high) = (self.points.low[block].load(simd), self.points.high[block].load(simd));
                for lane in each_bit(triangles) {
                    let at = flats.triangle_at(simd, lane, x, y);
                    let error = splat(simd, flats.z_error.0[lane]);
                    let (maybe, _) = self.before(simd, &at, error, low, high);
                    for ray in each_bit(maybe & self.points.open[block]) {
                        self.ask(block, ray, first + lane as u32);
                    }
                }
            },
        );
    }

    /// One ray against all triangles of a leaf but for those that can be cut out.
    #[inline(always)]
    fn cover_ray<S: Simd>(
        &mut self,
        simd: S,
        flats: &Flats,
        first: u32,
        cut: u32,
        block: usize,
        lane: usize,
    ) {
        let (x, y) = (self.rays.x[block].0[lane], self.rays.y[block].0[lane]);
        let at = flats.all_at(simd, x, y);
        let error = flats.z_error.load(simd);
        let low = splat(simd, self.points.low[block].0[lane]);
        let high = splat(simd, self.points.high[block].0[lane]);
        let (maybe, certain) = self.before(simd, &at, error, low, high);
        let mut maybe = maybe & flats.seen & !cut;
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
        let cut = cutout::bits_at(self.cutouts, first);
        for block in each_bit(blocks) {
            let mut triangles = flats.touching(simd, self.rays.around(block), self.points.least.0[block]);
            if triangles & cut != 0 {
                self.cover_cut(simd, flats, first, triangles & cut, block);
                triangles &= !cut;
            }
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
                    self.cover_ray(simd, flats, first, cut, block, lane);
                }
            } else {
                self.cover_block(simd, flats, first, triangles, block);
            }
        }
    }
}
