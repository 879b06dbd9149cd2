//! The closest hits of the rays of a tile: one of a camera with a projection, or of a plane mirror.
//!
//! The closeness z of a hit at t is 1 / t for rays from a point, and -t for parallel rays; see `rays::Projection`. Parallel rays
//! start at depth 0, and what is behind has a positive z.

use super::outline::PictureLines;
use super::projected_triangles::{At, ProjectedTriangles};
use super::query::{TileQuery, cover_nearest_first, cover_projected};
use super::traversal::{NodeFilter, Traversal};
use super::{Picture, Scratch};
use crate::compile::Item;
use crate::intersect::{Hit, cutout};
use crate::rays::{ALL_BLOCKS, BLOCKS, HitBlock, NO_ITEM, PictureTile, PrimitiveId, ROUNDING};
use crate::simd::{
    Lanes, Simd, SimdBase, bits, each_bit, f32x16, mask_of, select, select_indices, splat, u32x16,
};

/// Closeness of the hits of a tile, with error bounds.
pub(super) struct Closeness {
    /// Bounds of the closeness of each ray's hit; [`nowhere`] without a hit, infinity for rays that are not live.
    low: [Lanes; BLOCKS],
    high: [Lanes; BLOCKS],
    /// Least of `low` in each block.
    least: Lanes,
    /// Least of `least`.
    least_of_all: f32,
}

/// Closeness of what is infinitely far away.
#[inline(always)]
fn nowhere<T: PictureTile + ?Sized>(tile: &T) -> f32 {
    if tile.is_parallel() { f32::NEG_INFINITY } else { 0.0 }
}

impl Closeness {
    pub(super) const NONE: Closeness = Closeness {
        low: [Lanes::ZERO; BLOCKS],
        high: [Lanes::ZERO; BLOCKS],
        least: Lanes::ZERO,
        least_of_all: 0.0,
    };

    /// Resets all rays to no hit.
    #[inline(always)]
    fn clear<S: Simd, T: PictureTile + ?Sized>(&mut self, simd: S, tile: &T) {
        let infinite = splat(simd, f32::INFINITY);
        self.least_of_all = f32::INFINITY;
        for block in 0..BLOCKS {
            let start = select(mask_of(simd, tile.live(block)), splat(simd, nowhere(tile)), infinite);
            self.low[block].store(start);
            self.high[block].store(start);
            self.least.0[block] = if tile.live(block) == 0 { f32::INFINITY } else { nowhere(tile) };
            self.least_of_all = self.least_of_all.min(self.least.0[block]);
        }
    }

    /// Recomputes `least` of some blocks.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S, blocks: u32) {
        for block in each_bit(blocks) {
            self.least.0[block] = self.low[block].load(simd).reduce_min();
        }
        if blocks != 0 {
            self.least_of_all = self.least.load(simd).reduce_min();
        }
    }

    /// Records an exact hit at a depth. Hits that coincide with it are not behind `farthest`.
    fn record(&mut self, is_parallel: bool, (block, lane): (usize, usize), depth: f64, farthest: f64) {
        let (low, high) = if is_parallel {
            (-(farthest as f32) * (1.0 + ROUNDING), -(depth as f32) * (1.0 - ROUNDING))
        } else {
            let closeness = |depth: f64| (1.0 / depth) as f32;
            (closeness(farthest) * (1.0 - ROUNDING), closeness(depth) * (1.0 + ROUNDING))
        };
        self.low[block].0[lane] = low;
        self.high[block].0[lane] = high;
    }
}

/// Finds the closest hit of each live ray of a tile.
#[inline(always)]
pub(crate) fn find_closest<S: Simd, T: PictureTile + ?Sized>(
    simd: S,
    tile: &T,
    hits: &mut [HitBlock; BLOCKS],
    scratch: &mut Scratch,
) {
    let (frame, rays) = (tile.frame(), tile.picture());
    let Scratch { scene_stack, mesh_stack, projected, closeness, .. } = scratch;
    closeness.clear(simd, tile);
    for hits in hits.iter_mut() {
        *hits = HitBlock::NONE;
    }
    let picture = Picture { projection: tile.projection(), rays };
    let mut query = ClosestQuery { tile, item: NO_ITEM, cutouts: &[], closeness, hits };
    let mut traversal = Traversal::new(&frame.nodes, &[], picture, scene_stack).around_last();
    let mut lines = None;
    while let Some((leaf, blocks)) = traversal.next(simd, &query) {
        for &item in frame.items_of(leaf) {
            query.item = item;
            query.cutouts = frame.cutouts_of(item);
            match frame.items.get(item) {
                Item::Model(index) => {
                    let instance = &frame.instances[index];
                    let projection = tile.projection_of(instance);
                    let picture = Picture { projection: &projection, rays };
                    cover_nearest_first(simd, &instance.mesh, picture, mesh_stack, projected, &mut query);
                }
                Item::Triangle(index) => {
                    let corners = frame.triangles[index].corners;
                    projected.project_exactly(0, tile.projection(), corners, rays);
                    cover_projected(simd, projected, 0, ALL_BLOCKS, &mut query);
                }
                Item::Sphere(index) => {
                    let lines = lines.get_or_insert_with(|| PictureLines::new(tile.projection(), rays));
                    query.cover_sphere(simd, lines, index, blocks);
                }
                Item::Disk(_) => query.test_every_ray(simd, blocks),
            }
        }
    }
    for plane in 0..frame.planes.len() as u32 {
        query.item = frame.items.first_plane() + plane;
        query.test_every_ray(simd, ALL_BLOCKS);
    }
    if hits.iter().any(|hits| hits.coincident != 0) {
        resolve_coincident(tile, hits);
    }
}

/// Rays whose nearest hit may coincide with others hit one of the same surface everywhere: see `intersect::coincide`.
#[cold]
#[inline(never)]
fn resolve_coincident<T: PictureTile + ?Sized>(tile: &T, hits: &mut [HitBlock; BLOCKS]) {
    for (block, hits) in hits.iter_mut().enumerate() {
        for lane in each_bit(hits.coincident) {
            let nearest = hits.slot(lane);
            let ray = tile.ray(block, lane);
            let (preferred, others) =
                tile.frame().preferred(&ray, nearest, f64::INFINITY, tile.starts_on(block, lane));
            hits.coincident &= !(u32::from(!others) << lane);
            hits.set(lane, preferred);
        }
    }
}

/// Query for the closest triangle. While a tile is searched, [`HitBlock::coincident`] has the rays whose hit may coincide
/// with others.
struct ClosestQuery<'a, 'b, T: ?Sized> {
    tile: &'a T,
    /// The item whose triangles are tested.
    item: u32,
    /// Bits of its triangles that alpha cuts out.
    cutouts: &'a [u16],
    closeness: &'b mut Closeness,
    hits: &'b mut [HitBlock; BLOCKS],
}

/// The hits of a block while triangles are tested against it, in registers.
struct Nearest<S: Simd> {
    low: f32x16<S>,
    high: f32x16<S>,
    triangle: u32x16<S>,
    /// Bits of the rays that hit the current item.
    changed: u32,
}

impl<T: PictureTile + ?Sized> ClosestQuery<'_, '_, T> {
    /// Tests an item without lines in the picture, exactly, ray by ray.
    #[inline(always)]
    fn test_every_ray<S: Simd>(&mut self, simd: S, blocks: u32) {
        for block in each_bit(blocks) {
            for lane in each_bit(self.tile.live(block)) {
                self.test_exactly(block, lane, 0);
            }
        }
        self.closeness.settle(simd, blocks);
    }

    /// Tests a sphere against some blocks: exactly, for the rays inside its outline for which it is not farther for certain.
    #[inline(never)]
    fn cover_sphere<S: Simd>(&mut self, simd: S, lines: &PictureLines<'_>, index: usize, blocks: u32) {
        let outline = lines.outline(&self.tile.frame().spheres[index]);
        simd.vectorize(
            #[inline(always)]
            || {
                let mut tested = 0;
                for block in each_bit(blocks) {
                    let [may_hit, _] = outline.at(simd, self.tile.picture(), block);
                    let low = self.closeness.low[block].load(simd);
                    let farther = bits(splat(simd, outline.z_high).simd_lt(low));
                    let rays = may_hit & !farther & self.tile.live(block);
                    for lane in each_bit(rays) {
                        self.test_exactly(block, lane, 0);
                    }
                    tested |= u32::from(rays != 0) << block;
                }
                self.closeness.settle(simd, tested);
            },
        );
    }

    /// Tests exactly whether a primitive is the closest hit of a ray.
    #[inline(never)]
    fn test_exactly(&mut self, block: usize, lane: usize, triangle: u32) {
        let (ray, starts_on) = (self.tile.ray(block, lane), self.tile.starts_on(block, lane));
        let frame = self.tile.frame();
        let primitive = PrimitiveId { item: self.item, triangle };
        let Some(hit) = frame.hit_of(&ray, primitive, starts_on) else { return };
        let slack = frame.slack(&ray, primitive, hit.t);
        let hits = &mut self.hits[block];
        let best: Option<Hit> =
            hits.primitive(lane).and_then(|primitive| frame.hit_of(&ray, primitive, starts_on));
        if best.is_some_and(|best| (hit.t - best.t).abs() <= slack) {
            hits.coincident |= 1 << lane;
        }
        if best.is_none_or(|best| hit.wins_over(&best, frame)) {
            hits.set(lane, primitive);
            let depth = |t: f64| self.tile.depth(block, lane, t);
            let is_parallel = self.tile.is_parallel();
            self.closeness.record(is_parallel, (block, lane), depth(hit.t), depth(hit.t + slack));
        }
    }

    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, block: usize, changed: u32) -> Nearest<S> {
        Nearest {
            low: self.closeness.low[block].load(simd),
            high: self.closeness.high[block].load(simd),
            triangle: self.hits[block].triangle.load(simd),
            changed,
        }
    }

    #[inline(always)]
    fn store<S: Simd>(&mut self, simd: S, block: usize, nearest: &Nearest<S>) {
        self.closeness.low[block].store(nearest.low);
        self.closeness.high[block].store(nearest.high);
        self.hits[block].triangle.store(nearest.triangle);
        self.hits[block].item.put(simd, mask_of(simd, nearest.changed), self.item);
    }

    /// Tests some triangles against one block of rays. Returns whether a hit may have changed.
    #[inline(always)]
    fn cover_block<S: Simd>(
        &mut self,
        simd: S,
        projected: &ProjectedTriangles,
        first: u32,
        triangles: u32,
        block: usize,
    ) -> bool {
        let rays = self.tile.picture();
        let (x, y) = (rays.x[block].load(simd), rays.y[block].load(simd));
        let mut nearest = self.load(simd, block, 0);
        let mut tested = 0;
        for lane in each_bit(triangles) {
            let At { maybe, certain, z } = projected.triangle_at(simd, lane, x, y);
            let error = splat(simd, projected.z_error.0[lane]);
            let (z_low, z_high) = (z - error, z + error);
            // All that is not farther for certain, even if a number is NaN.
            let maybe = maybe & !bits(z_high.simd_lt(nearest.low));
            let mut certain = maybe & certain & bits(z_low.simd_gt(nearest.high));
            let mut maybe = maybe;
            if let Some(starts) = self.tile.starts() {
                if starts.primitive == (PrimitiveId { item: self.item, triangle: first + lane as u32 }) {
                    continue;
                }
                let [may_have, has] = starts.before(simd, block, z_low, z_high);
                maybe &= may_have;
                certain &= has;
            }
            if self.tile.is_parallel() {
                // Only the exact test distinguishes a triangle on the plane of the origins from one behind it.
                certain &= bits(z_high.simd_lt(splat(simd, 0.0)));
                maybe &= !bits(z_low.simd_gt(splat(simd, 0.0)));
            }
            let mask = mask_of(simd, certain);
            nearest.low = select(mask, z_low, nearest.low);
            nearest.high = select(mask, z_high, nearest.high);
            let triangle = u32x16::splat(simd, first + lane as u32);
            nearest.triangle = select_indices(mask, triangle, nearest.triangle);
            nearest.changed |= certain;
            tested |= maybe & !certain;
            if maybe & !certain != 0 {
                self.store(simd, block, &nearest);
                for ray in each_bit(maybe & !certain) {
                    self.test_exactly(block, ray, first + lane as u32);
                }
                nearest = self.load(simd, block, nearest.changed);
            }
        }
        self.store(simd, block, &nearest);
        nearest.changed | tested != 0
    }

    /// As [`ClosestQuery::cover_block`] for triangles with cut-outs: all rays for which such a triangle is not farther for
    /// certain are tested exactly.
    #[cold]
    #[inline(never)]
    fn cover_cut<S: Simd>(
        &mut self,
        simd: S,
        projected: &ProjectedTriangles,
        first: u32,
        triangles: u32,
        block: usize,
    ) -> bool {
        simd.vectorize(
            #[inline(always)]
            || {
                let rays = self.tile.picture();
                let (x, y) = (rays.x[block].load(simd), rays.y[block].load(simd));
                let mut tested = 0;
                for lane in each_bit(triangles) {
                    let At { maybe, z, .. } = projected.triangle_at(simd, lane, x, y);
                    let z_high = z + splat(simd, projected.z_error.0[lane]);
                    let maybe = maybe & !bits(z_high.simd_lt(self.closeness.low[block].load(simd)));
                    for ray in each_bit(maybe) {
                        self.test_exactly(block, ray, first + lane as u32);
                    }
                    tested |= maybe;
                }
                tested != 0
            },
        )
    }
}

impl<S: Simd, T: PictureTile + ?Sized> NodeFilter<S> for ClosestQuery<'_, '_, T> {
    const ON_GRID: bool = true;

    #[inline(always)]
    fn is_from_plane(&self) -> bool {
        self.tile.is_parallel()
    }

    fn least(&self) -> &Lanes {
        &self.closeness.least
    }

    fn least_closeness(&self) -> f32 {
        self.closeness.least_of_all
    }

    #[inline(always)]
    fn refine(&self, _: S, _: [f32; 4], _: f32, blocks: u32) -> u32 {
        blocks
    }
}

impl<S: Simd, T: PictureTile + ?Sized> TileQuery<S> for ClosestQuery<'_, '_, T> {
    /// Block by block, so that the hits of a block stay in registers.
    #[inline(always)]
    fn cover(&mut self, simd: S, projected: &ProjectedTriangles, first: u32, blocks: u32) {
        let mut changed = 0;
        let cut = cutout::bits_at(self.cutouts, first);
        for block in each_bit(blocks) {
            let rectangle = self.tile.picture().around(block);
            let triangles = projected.touching(simd, rectangle, self.closeness.least.0[block]);
            if triangles != 0 {
                let mut any = self.cover_block(simd, projected, first, triangles & !cut, block);
                if triangles & cut != 0 {
                    any |= self.cover_cut(simd, projected, first, triangles & cut, block);
                }
                changed |= u32::from(any) << block;
            }
        }
        self.closeness.settle(simd, changed);
    }
}
