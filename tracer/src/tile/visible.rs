//! What each ray of a tile sees first.

use glam::DVec3;

use super::cover::{Question, cover_nearest_first, cover_set_up};
use super::lens::{Lens, ROUNDING};
use super::setup::{At, Flats};
use super::walk::{Interest, Walk};
use super::{ALL_BLOCKS, BLOCKS, Rays, Scratch};
use crate::compile::Item;
use crate::cutout;
use crate::frame::{Instance, PreparedFrame};
use crate::simd::vector::Vec3x16;
use crate::simd::{
    Indices, LANES, Lanes, Simd, SimdBase, bits, each_bit, f32x16, mask_of, select, select_indices, splat,
    three, u32x16,
};
use crate::trace::{Hit, PrimitiveId, Ray};

/// No item: a ray that sees nothing.
pub(crate) const NOTHING: u32 = u32::MAX;

/// What the rays of a tile see.
pub(crate) struct Visible {
    /// Index of the item, or [`NOTHING`].
    pub item: [Indices; BLOCKS],
    /// Index of the triangle in its mesh.
    pub triangle: [Indices; BLOCKS],
    /// Closeness (1 / depth) of what is seen lies between these. Rays that do not count have infinity.
    low: [Lanes; BLOCKS],
    high: [Lanes; BLOCKS],
    /// Least of `low` in each block.
    least: Lanes,
    /// Least of `least`.
    least_of_all: f32,
    /// Rays that see one of several surfaces in one place; while a tile is searched, those that may.
    pub tied: [u32; BLOCKS],
}

impl Visible {
    /// For [`EyeTile::find_visible`] to fill.
    pub(crate) fn empty() -> Self {
        Self {
            item: [Indices::ZERO; BLOCKS],
            triangle: [Indices::ZERO; BLOCKS],
            low: [Lanes::ZERO; BLOCKS],
            high: [Lanes::ZERO; BLOCKS],
            least: Lanes::ZERO,
            least_of_all: 0.0,
            tied: [0; BLOCKS],
        }
    }

    /// Nothing seen yet; rays without their bit in `live` do not count.
    #[inline(always)]
    fn clear<S: Simd>(&mut self, simd: S, live: &[u32; BLOCKS]) {
        let infinite = splat(simd, f32::INFINITY);
        self.least_of_all = f32::INFINITY;
        self.tied = [0; BLOCKS];
        for block in 0..BLOCKS {
            let start = select(mask_of(simd, live[block]), splat(simd, 0.0), infinite);
            self.low[block].store(start);
            self.high[block].store(start);
            self.item[block] = Indices([NOTHING; LANES]);
            self.triangle[block] = Indices::ZERO;
            self.least.0[block] = if live[block] == 0 { f32::INFINITY } else { 0.0 };
            self.least_of_all = self.least_of_all.min(self.least.0[block]);
        }
    }

    /// Writes back what the rays of a block see; `changed` are the bits of those that now see `item`.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "what was held in registers")]
    fn keep<S: Simd>(
        &mut self,
        simd: S,
        block: usize,
        low: f32x16<S>,
        high: f32x16<S>,
        triangles: u32x16<S>,
        changed: u32,
        item: u32,
    ) {
        self.low[block].store(low);
        self.high[block].store(high);
        self.triangle[block].store(triangles);
        self.item[block].put(simd, mask_of(simd, changed), item);
    }

    /// Brings `least` of some blocks up to date.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S, blocks: u32) {
        for block in each_bit(blocks) {
            self.least.0[block] = self.low[block].load(simd).reduce_min();
        }
        if blocks != 0 {
            self.least_of_all = self.least.load(simd).reduce_min();
        }
    }

    /// What coincides with the hit is at most `slack` behind it.
    fn see(&mut self, block: usize, lane: usize, hit: &Hit, slack: f64) {
        let closeness = |t: f64| (1.0 / t) as f32;
        self.low[block].0[lane] = closeness(hit.t + slack) * (1.0 - ROUNDING);
        self.high[block].0[lane] = closeness(hit.t) * (1.0 + ROUNDING);
        self.item[block].0[lane] = hit.primitive.item;
        self.triangle[block].0[lane] = hit.primitive.triangle;
    }
}

/// The rays of one tile of a frame.
pub(crate) struct EyeTile<'a> {
    pub frame: &'a PreparedFrame,
    pub rays: &'a Rays,
    /// From eye space.
    pub lens: Lens,
    /// Which rays count.
    pub live: [u32; BLOCKS],
    /// How far, in its picture and in depth, surfaces may be off that coincide: see [`Lens::drift`].
    drift: [f32; 2],
    /// Samples along a side of a pixel, as this tile counts them.
    grid: f64,
    /// How much larger its picture is than that of the frame.
    enlarged: f64,
    /// The tile's centre, in its samples from the corner of the picture.
    center: [f64; 2],
    /// Direction through the tile's centre, and what a step right and a step down add.
    pub steps: [DVec3; 3],
    rounded_steps: [[f32; 3]; 3],
}

impl<'a> EyeTile<'a> {
    /// Rays around `center`, which is told in samples from the corner of the picture, `grid` of them along a side of a pixel.
    pub(crate) fn new(
        frame: &'a PreparedFrame,
        rays: &'a Rays,
        live: [u32; BLOCKS],
        center: [f64; 2],
        grid: u32,
    ) -> Self {
        let [right, down] = frame.rays.steps(grid);
        let enlarged = f64::from(grid) / f64::from(frame.rays.grid());
        let grid = f64::from(grid);
        let steps = [frame.rays.through(center[0] / grid, center[1] / grid), right, down];
        let rounded_steps = three!(i => steps[i].as_vec3().to_array());
        let picture = frame.projection.enlarged(enlarged).centered(center[0], center[1]);
        let [near, far] = Lens::drift(&picture, frame.coarsest);
        let lens = Lens::new(picture, 1.0, false).drifting([near, far], 2.0 * frame.coarsest);
        Self { frame, rays, lens, drift: [near, far], grid, enlarged, center, live, steps, rounded_steps }
    }

    /// How the tile sees a mesh.
    #[inline(always)]
    fn lens_of(&self, instance: &Instance) -> Lens {
        let [x, y] = self.center;
        Lens::new(instance.projection.enlarged(self.enlarged).centered(x, y), 1.0, false)
            .drifting(self.drift, f64::from(instance.drift))
    }

    /// The ray of a lane, exactly.
    pub(crate) fn ray(&self, block: usize, lane: usize) -> Ray {
        let x = self.center[0] + f64::from(self.rays.x[block].0[lane]);
        let y = self.center[1] + f64::from(self.rays.y[block].0[lane]);
        Ray { origin: DVec3::ZERO, direction: self.frame.rays.through(x / self.grid, y / self.grid) }
    }

    /// Directions of the rays of a block in eye space, rounded.
    #[inline(always)]
    pub(crate) fn directions<S: Simd>(&self, simd: S, block: usize) -> Vec3x16<S> {
        let [center, right, down] = three!(i => Vec3x16::splat(simd, self.rounded_steps[i]));
        let (x, y) = (self.rays.x[block].load(simd), self.rays.y[block].load(simd));
        center.add(right.scale(x)).add(down.scale(y))
    }

    /// Finds what each ray sees.
    #[inline(always)]
    pub(crate) fn find_visible<S: Simd>(&self, simd: S, visible: &mut Visible, scratch: &mut Scratch) {
        visible.clear(simd, &self.live);
        let Scratch { scene_stack, mesh_stack, flats, .. } = scratch;
        let mut nearest = Nearest { tile: self, item: NOTHING, cutouts: &[], visible };
        let mut walk = Walk::new(&self.frame.nodes, &[], &self.lens, self.rays, scene_stack).around_last();
        while let Some((leaf, _)) = walk.next(simd, &nearest) {
            for &item in self.frame.items_of(leaf) {
                nearest.item = item;
                nearest.cutouts = self.frame.cutouts_of(item);
                match self.frame.items.get(item) {
                    Item::Model(index) => {
                        let instance = &self.frame.instances[index];
                        let lens = self.lens_of(instance);
                        cover_nearest_first(
                            simd,
                            &instance.mesh,
                            &lens,
                            self.rays,
                            mesh_stack,
                            flats,
                            &mut nearest,
                        );
                    }
                    Item::Triangle(index) => {
                        let corners = self.frame.triangles[index].corners;
                        flats.set_up_exactly(0, &self.lens, corners, self.rays);
                        cover_set_up(simd, flats, 0, ALL_BLOCKS, &mut nearest);
                    }
                    Item::Sphere(_) => nearest.ask_every_ray(simd),
                }
            }
        }
        for plane in 0..self.frame.planes.len() as u32 {
            nearest.item = self.frame.items.first_plane() + plane;
            nearest.ask_every_ray(simd);
        }
        if visible.tied != [0; BLOCKS] {
            self.settle_ties(visible);
        }
    }

    /// Rays whose nearest hit may coincide with others see one of the same surface all over: see `trace/coincide.rs`.
    #[cold]
    #[inline(never)]
    fn settle_ties(&self, visible: &mut Visible) {
        for block in 0..BLOCKS {
            for lane in each_bit(visible.tied[block]) {
                let (item, triangle) = (visible.item[block].0[lane], visible.triangle[block].0[lane]);
                let nearest = PrimitiveId { item, triangle };
                let (seen, others) = self.frame.preferred(&self.ray(block, lane), nearest, f64::INFINITY);
                visible.tied[block] &= !(u32::from(!others) << lane);
                visible.item[block].0[lane] = seen.item;
                visible.triangle[block].0[lane] = seen.triangle;
            }
        }
    }
}

/// Asks for the nearest triangle.
struct Nearest<'a, 'b> {
    tile: &'a EyeTile<'a>,
    item: u32,
    /// Which triangles of the item can be cut out.
    cutouts: &'a [u16],
    visible: &'b mut Visible,
}

impl Nearest<'_, '_> {
    /// Items without lines in the picture: exactly, ray by ray.
    #[inline(always)]
    fn ask_every_ray<S: Simd>(&mut self, simd: S) {
        for block in 0..BLOCKS {
            for lane in each_bit(self.tile.live[block]) {
                self.ask(block, lane, 0);
            }
        }
        self.visible.settle(simd, ALL_BLOCKS);
    }

    /// Whether a primitive is what a ray sees, to the last digit.
    #[inline(never)]
    fn ask(&mut self, block: usize, lane: usize, triangle: u32) {
        let ray = self.tile.ray(block, lane);
        let frame = self.tile.frame;
        let primitive = PrimitiveId { item: self.item, triangle };
        let Some(hit) = frame.hit_of(&ray, primitive, None) else { return };
        let slack = frame.slack(&ray, primitive, hit.t);
        let seen = self.visible.item[block].0[lane];
        let best = (seen != NOTHING)
            .then(|| PrimitiveId { item: seen, triangle: self.visible.triangle[block].0[lane] })
            .and_then(|seen| frame.hit_of(&ray, seen, None));
        if best.is_some_and(|best| (hit.t - best.t).abs() <= slack) {
            self.visible.tied[block] |= 1 << lane;
        }
        if best.is_none_or(|best| hit.wins_over(&best)) {
            self.visible.see(block, lane, &hit, slack);
        }
    }
}

impl<S: Simd> Interest<S> for Nearest<'_, '_> {
    const ON_GRID: bool = true;

    fn least(&self) -> &Lanes {
        &self.visible.least
    }

    fn least_closeness(&self) -> f32 {
        self.visible.least_of_all
    }

    #[inline(always)]
    fn refine(&self, _: S, _: [f32; 4], _: f32, blocks: u32) -> u32 {
        blocks
    }
}

impl<S: Simd> Question<S> for Nearest<'_, '_> {
    /// Block by block, so that what a block sees stays in registers.
    #[inline(always)]
    fn cover(&mut self, simd: S, flats: &Flats, first: u32, blocks: u32) {
        let mut changed = 0;
        let cut = cutout::bits_at(self.cutouts, first);
        for block in each_bit(blocks) {
            let triangles = flats.touching(simd, self.tile.rays.around(block), self.visible.least.0[block]);
            if triangles != 0 {
                let mut any = self.cover_block(simd, flats, first, triangles & !cut, block);
                if triangles & cut != 0 {
                    any |= self.cover_cut(simd, flats, first, triangles & cut, block);
                }
                changed |= u32::from(any) << block;
            }
        }
        self.visible.settle(simd, changed);
    }
}

impl Nearest<'_, '_> {
    /// Some triangles against one block of rays. Returns whether a ray may see another one now.
    #[inline(always)]
    fn cover_block<S: Simd>(
        &mut self,
        simd: S,
        flats: &Flats,
        first: u32,
        triangles: u32,
        block: usize,
    ) -> bool {
        let rays = self.tile.rays;
        let (x, y) = (rays.x[block].load(simd), rays.y[block].load(simd));
        let (mut low, mut high) = (self.visible.low[block].load(simd), self.visible.high[block].load(simd));
        let mut seen = self.visible.triangle[block].load(simd);
        let (mut changed, mut asked) = (0, 0);
        for lane in each_bit(triangles) {
            let At { maybe, certain, z } = flats.triangle_at(simd, lane, x, y);
            let error = splat(simd, flats.z_error.0[lane]);
            let (z_low, z_high) = (z - error, z + error);
            // What is not certain to be farther, even where a number is NaN.
            let maybe = maybe & !bits(z_high.simd_lt(low));
            let certain = maybe & certain & bits(z_low.simd_gt(high));
            let mask = mask_of(simd, certain);
            low = select(mask, z_low, low);
            high = select(mask, z_high, high);
            seen = select_indices(mask, u32x16::splat(simd, first + lane as u32), seen);
            changed |= certain;
            asked |= maybe & !certain;
            if maybe & !certain != 0 {
                self.visible.keep(simd, block, low, high, seen, changed, self.item);
                for ray in each_bit(maybe & !certain) {
                    self.ask(block, ray, first + lane as u32);
                }
                (low, high) = (self.visible.low[block].load(simd), self.visible.high[block].load(simd));
                seen = self.visible.triangle[block].load(simd);
            }
        }
        self.visible.keep(simd, block, low, high, seen, changed, self.item);
        changed | asked != 0
    }

    /// As [`Nearest::cover_block`] for triangles that can be cut out: of what is not certain to be farther, each ray is asked
    /// exactly.
    #[cold]
    #[inline(never)]
    fn cover_cut<S: Simd>(
        &mut self,
        simd: S,
        flats: &Flats,
        first: u32,
        triangles: u32,
        block: usize,
    ) -> bool {
        simd.vectorize(
            #[inline(always)]
            || {
                let rays = self.tile.rays;
                let (x, y) = (rays.x[block].load(simd), rays.y[block].load(simd));
                let mut asked = 0;
                for lane in each_bit(triangles) {
                    let At { maybe, z, .. } = flats.triangle_at(simd, lane, x, y);
                    let z_high = z + splat(simd, flats.z_error.0[lane]);
                    let maybe = maybe & !bits(z_high.simd_lt(self.visible.low[block].load(simd)));
                    for ray in each_bit(maybe) {
                        self.ask(block, ray, first + lane as u32);
                    }
                    asked |= maybe;
                }
                asked != 0
            },
        )
    }
}
