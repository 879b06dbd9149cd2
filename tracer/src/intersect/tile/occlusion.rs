//! Occlusion of the points of a tile: boxes and triangles between them and a light.

use super::Picture;
use super::outline::PictureLines;
use super::points::Points;
use super::projected_triangles::{At, ProjectedTriangles};
use super::query::{TileQuery, cover_any_order, cover_projected};
use super::traversal::{Frontier, Leaf, NodeFilter};
use crate::compile::Item;
use crate::intersect::cutout;
use crate::rays::{ALL_BLOCKS, BLOCKS, NO_ITEM, PrimitiveId, Projection, RaySource, ShadowTile, TileRays};
use crate::simd::{Lanes, Simd, SimdBase, bits, each_bit, f32x16, splat, u32x16};

/// Ratio of the closeness of a triangle to that of a point below which the triangle is before `t_max` for certain: half of the
/// ratio at `t_max`.
const BEFORE_LIGHT: f32 = (1 << 17) as f32;

/// Boxes that touch at most this many blocks are tested against single rays.
const FEW_BLOCKS: u32 = 8;

/// At most this many triangles are tested against a block of rays without counting its rays first.
const FEW_TRIANGLES: u32 = 3;

/// Query for the points that anything occludes.
pub(super) struct OcclusionQuery<'a> {
    pub tile: &'a ShadowTile<'a>,
    pub rays: &'a TileRays,
    pub points: &'a mut Points,
    /// The item whose triangles are tested.
    item: u32,
    /// Bits of its triangles that alpha cuts out.
    cutouts: &'a [u16],
    /// Whether light may pass it.
    is_translucent: bool,
}

impl<'a> OcclusionQuery<'a> {
    /// A query without an item.
    pub(super) fn new(tile: &'a ShadowTile<'a>, rays: &'a TileRays, points: &'a mut Points) -> Self {
        Self { tile, rays, points, item: NO_ITEM, cutouts: &[], is_translucent: false }
    }

    /// Selects the item that is tested next. Returns whether it stops any light.
    #[inline(always)]
    pub(super) fn turn_to(&mut self, item: u32) -> bool {
        self.item = item;
        self.cutouts = self.tile.frame.cutouts_of(item);
        self.is_translucent = self.tile.frame.is_translucent(item);
        !self.tile.frame.is_clear(item)
    }

    /// Tests the selected item, of a leaf of the scene's tree, against all open points.
    #[inline(always)]
    pub(super) fn cover_item<'p, S: Simd>(
        &mut self,
        simd: S,
        leaf: Leaf,
        projection: &'p Projection,
        lines: &mut Option<PictureLines<'p>>,
        frontier: &mut Frontier,
        projected: &mut ProjectedTriangles,
    ) {
        match self.tile.frame.items.get(self.item) {
            Item::Model(index) => {
                let instance = &self.tile.frame.instances[index];
                let projection = projection.of(&instance.placement, 1.0);
                let picture = Picture { projection: &projection, rays: self.rays };
                cover_any_order(simd, &instance.mesh, picture, frontier, projected, self);
            }
            Item::Triangle(index) => {
                let corners = self.tile.frame.triangles[index].corners;
                projected.project_exactly(0, projection, corners, self.rays);
                cover_projected(simd, projected, 0, ALL_BLOCKS, self);
            }
            Item::Sphere(index) => {
                let lines = lines.get_or_insert_with(|| PictureLines::new(projection, self.rays));
                self.cover_sphere(simd, lines, index, leaf);
            }
            Item::Disk(_) => self.test_item(leaf.blocks),
        }
    }

    /// Tests a sphere against the open points of some blocks. Points whose rays pass through it, and that are behind all of
    /// it, are occluded.
    #[inline(never)]
    fn cover_sphere<S: Simd>(&mut self, simd: S, lines: &PictureLines<'_>, index: usize, leaf: Leaf) {
        let outline = lines.outline(&self.tile.frame.spheres[index]);
        simd.vectorize(
            #[inline(always)]
            || {
                for block in each_bit(leaf.blocks) {
                    let open = self.points.open_before(simd, block, leaf.z_most);
                    if open == 0 {
                        continue;
                    }
                    let [may_hit, inside] = outline.at(simd, self.rays, block);
                    let (low, high) = (self.points.low[block].load(simd), self.points.high[block].load(simd));
                    let mut before = bits(splat(simd, outline.z_low).simd_gt(high));
                    if self.tile.t_max.is_finite() {
                        // Only the exact test distinguishes a sphere next to the light from the light.
                        let end = low * splat(simd, BEFORE_LIGHT);
                        before &= bits(splat(simd, outline.z_high).simd_lt(end));
                    }
                    let certain = open & inside & before;
                    if certain != 0 {
                        self.mark(block, certain);
                    }
                    for lane in each_bit(open & may_hit & !certain) {
                        self.test_exactly(block, lane, 0);
                    }
                }
            },
        );
    }

    /// Tests the selected item exactly, for every open point of some blocks.
    pub(super) fn test_item(&mut self, blocks: u32) {
        for block in each_bit(blocks) {
            for lane in each_bit(self.points.open[block]) {
                self.test_exactly(block, lane, 0);
            }
        }
    }

    /// Tests the whole scene for every open point, ray by ray.
    pub(super) fn test_scene(&mut self) {
        for block in 0..BLOCKS {
            for lane in each_bit(self.points.open[block]) {
                let (ray, starts_on) = (self.tile.ray(block, lane), self.tile.starts_on(block, lane));
                if self.tile.frame.occluded(&ray, self.tile.t_max, starts_on) {
                    let found = if self.tile.frame.has_translucent_items() {
                        &mut self.points.undecided
                    } else {
                        &mut self.points.occluded
                    };
                    found[block] |= 1 << lane;
                }
            }
        }
    }

    /// Tests exactly whether a primitive occludes a point.
    #[inline(never)]
    fn test_exactly(&mut self, block: usize, lane: usize, triangle: u32) {
        let (ray, starts_on) = (self.tile.ray(block, lane), self.tile.starts_on(block, lane));
        let primitive = PrimitiveId { item: self.item, triangle };
        let t = self.tile.frame.t_of(&ray, primitive, starts_on);
        if t.is_some_and(|t| t < self.tile.t_max) {
            self.mark(block, 1 << lane);
        }
    }

    /// Marks points that the selected item occludes. Behind an item that light may pass they stay open: another one may be opaque.
    #[inline(always)]
    fn mark(&mut self, block: usize, lanes: u32) {
        if self.is_translucent {
            self.points.undecided[block] |= lanes;
        } else {
            self.points.mark_occluded(block, lanes);
        }
    }

    /// Tests some triangles against one block of rays.
    #[inline(always)]
    fn cover_block<S: Simd>(
        &mut self,
        simd: S,
        projected: &ProjectedTriangles,
        first: u32,
        triangles: u32,
        block: usize,
    ) {
        let (x, y) = (self.rays.x[block].load(simd), self.rays.y[block].load(simd));
        let (low, high) = (self.points.low[block].load(simd), self.points.high[block].load(simd));
        let own_item = self.tile.hits[block].item.equal(simd, self.item);
        let own_triangle = self.tile.hits[block].triangle.load(simd);
        for lane in each_bit(triangles) {
            let triangle = first + lane as u32;
            let at = projected.triangle_at(simd, lane, x, y);
            let (maybe, certain) = self.before(simd, &at, splat(simd, projected.z_error.0[lane]), low, high);
            // The triangle that a point is on does not occlude it.
            let own = own_item & bits(own_triangle.simd_eq(u32x16::splat(simd, triangle)));
            let maybe = maybe & self.points.open[block] & !own;
            if maybe == 0 {
                continue;
            }
            self.mark(block, maybe & certain);
            for ray in each_bit(maybe & !certain) {
                self.test_exactly(block, ray, triangle);
            }
        }
    }

    /// As [`OcclusionQuery::cover_block`] for triangles with cut-outs: each ray that such a triangle may occlude is tested
    /// exactly.
    #[cold]
    #[inline(never)]
    fn cover_cut<S: Simd>(
        &mut self,
        simd: S,
        projected: &ProjectedTriangles,
        first: u32,
        triangles: u32,
        block: usize,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (x, y) = (self.rays.x[block].load(simd), self.rays.y[block].load(simd));
                let (low, high) = (self.points.low[block].load(simd), self.points.high[block].load(simd));
                for lane in each_bit(triangles) {
                    let at = projected.triangle_at(simd, lane, x, y);
                    let error = splat(simd, projected.z_error.0[lane]);
                    let (maybe, _) = self.before(simd, &at, error, low, high);
                    for ray in each_bit(maybe & self.points.open[block]) {
                        self.test_exactly(block, ray, first + lane as u32);
                    }
                }
            },
        );
    }

    /// Tests one ray against all triangles of a leaf, except for those in `cut`.
    #[inline(always)]
    fn cover_ray<S: Simd>(
        &mut self,
        simd: S,
        projected: &ProjectedTriangles,
        first: u32,
        cut: u32,
        block: usize,
        lane: usize,
    ) {
        let (x, y) = (self.rays.x[block].0[lane], self.rays.y[block].0[lane]);
        let at = projected.all_at(simd, x, y);
        let error = projected.z_error.load(simd);
        let low = splat(simd, self.points.low[block].0[lane]);
        let high = splat(simd, self.points.high[block].0[lane]);
        let (maybe, certain) = self.before(simd, &at, error, low, high);
        let mut maybe = maybe & projected.active & !cut;
        let hits = &self.tile.hits[block];
        if hits.item.0[lane] == self.item {
            let own = hits.triangle.0[lane].wrapping_sub(first);
            maybe &= !1_u32.checked_shl(own).unwrap_or(0);
        }
        if maybe & certain != 0 {
            return self.mark(block, 1 << lane);
        }
        for triangle in each_bit(maybe) {
            self.test_exactly(block, lane, first + triangle as u32);
            if self.points.open[block] >> lane & 1 == 0 {
                return;
            }
        }
    }

    /// Bits of the places where a triangle may be, and where it is for certain, between the light and points whose closeness
    /// is within `low` and `high`.
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
        if self.tile.t_max.is_finite() {
            // Only the exact test distinguishes a triangle next to the light from the light.
            certain &= bits(z_high.simd_lt(low * splat(simd, BEFORE_LIGHT)));
        }
        (maybe, certain)
    }
}

impl<S: Simd> NodeFilter<S> for OcclusionQuery<'_> {
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
        // A small box: it may be between the rays.
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

impl<S: Simd> TileQuery<S> for OcclusionQuery<'_> {
    /// Block by block, and in each triangle by triangle or ray by ray, whichever takes fewer steps.
    #[inline(always)]
    fn cover(&mut self, simd: S, projected: &ProjectedTriangles, first: u32, blocks: u32) {
        let mut hull = None;
        let cut = cutout::bits_at(self.cutouts, first);
        for block in each_bit(blocks) {
            let mut triangles = projected.touching(simd, self.rays.around(block), self.points.least.0[block]);
            if triangles & cut != 0 {
                self.cover_cut(simd, projected, first, triangles & cut, block);
                triangles &= !cut;
            }
            if triangles.count_ones() <= FEW_TRIANGLES {
                self.cover_block(simd, projected, first, triangles, block);
                continue;
            }
            if hull.is_none() {
                hull = Some(projected.hull(simd));
            }
            let Some((around, z_most)) = hull else { continue };
            let rays = self.rays.rays_in(simd, block, around) & self.points.open_before(simd, block, z_most);
            if rays.count_ones() < triangles.count_ones() {
                for lane in each_bit(rays) {
                    self.cover_ray(simd, projected, first, cut, block, lane);
                }
            } else {
                self.cover_block(simd, projected, first, triangles, block);
            }
        }
    }
}
