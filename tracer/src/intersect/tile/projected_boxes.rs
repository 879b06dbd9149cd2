//! The boxes of a node in the picture of a projection: sixteen rectangles at once.

use super::traversal::NodeFilter;
use crate::bvh::WideNode;
use crate::rays::{Frustum, Projection, ROUNDING, TileRays};
use crate::simd::{
    Indices, Lanes, Simd, SimdBase, SimdFloat, bits, each_bit, f32x16, fma, select, select_indices, splat,
    u32x16,
};

/// A linear function of points, with the corners of boxes at which it is least and greatest.
pub(super) struct Row {
    factors: [f32; 4],
    /// Indices of the sides of boxes (see [`WideNode::sides`]) on each axis.
    least: [usize; 3],
    greatest: [usize; 3],
}

impl Row {
    #[inline(always)]
    pub(super) fn new(factors: [f32; 4]) -> Self {
        let [mut least, mut greatest] = [[0; 3]; 2];
        for axis in 0..3 {
            let falls = usize::from(factors[axis] < 0.0);
            least[axis] = axis + 3 * falls;
            greatest[axis] = axis + 3 * (1 - falls);
        }
        Self { factors, least, greatest }
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, node: &WideNode, corner: [usize; 3]) -> f32x16<S> {
        let mut sum = splat(simd, self.factors[3]);
        for axis in 0..3 {
            sum = fma(splat(simd, self.factors[axis]), node.sides()[corner[axis]].load(simd), sum);
        }
        sum
    }

    /// Least value in each box.
    #[inline(always)]
    fn least<S: Simd>(&self, simd: S, node: &WideNode) -> f32x16<S> {
        self.at(simd, node, self.least)
    }

    /// Greatest value in each box.
    #[inline(always)]
    fn greatest<S: Simd>(&self, simd: S, node: &WideNode) -> f32x16<S> {
        self.at(simd, node, self.greatest)
    }
}

/// Bits of the children that a frustum may contain.
#[inline(always)]
pub(super) fn in_frustum<S: Simd>(simd: S, node: &WideNode, frustum: &Frustum) -> u32 {
    let mut outside = splat(simd, 0.0).simd_gt(splat(simd, 1.0));
    for side in 0..4 {
        let least = Row::new(frustum.planes[side]).least(simd, node);
        outside |= least.simd_gt(splat(simd, frustum.error[side]));
    }
    if !frustum.parallel {
        let farthest = Row::new(frustum.planes[4]).greatest(simd, node);
        outside |= farthest.simd_lt(splat(simd, -frustum.error[4]));
    }
    !bits(outside)
}

/// Bits of the children that may reach depths above 0. `depth` is the row of depths, with its error bound.
#[inline(always)]
pub(super) fn in_front<S: Simd>(simd: S, node: &WideNode, depth: &Row, error: f32) -> u32 {
    bits(depth.greatest(simd, node).simd_ge(splat(simd, -error)))
}

/// Rectangles around the boxes of a node in the picture.
pub(super) struct ProjectedBoxes {
    sides: [Lanes; 4],
    /// Greatest closeness of each box. Infinity if the box reaches behind the projection: then its rectangle is undefined.
    pub z_most: Lanes,
    /// Bits of the boxes that reach behind the projection.
    pub crossing: u32,
}

impl ProjectedBoxes {
    #[inline(always)]
    pub(super) fn new<S: Simd>(
        simd: S,
        node: &WideNode,
        projection: &Projection,
        [a, b, g]: &[Row; 3],
    ) -> Self {
        let one = splat(simd, 1.0);
        let [error, g_error] = [splat(simd, projection.error[0]), splat(simd, projection.error[1])];
        let nearest = g.least(simd, node) - g_error;
        let mut boxes = Self { sides: [Lanes::ZERO; 4], z_most: Lanes::ZERO, crossing: 0 };
        let (z_most, z_least) = if projection.parallel {
            boxes.z_most.store(-nearest);
            (one, one)
        } else {
            let z_most = one / nearest;
            let before = nearest.simd_gt(splat(simd, 0.0));
            let widened = z_most * splat(simd, 1.0 + 8.0 * ROUNDING);
            boxes.z_most.store(select(before, widened, splat(simd, f32::INFINITY)));
            boxes.crossing = !bits(before);
            (z_most, one / (g.greatest(simd, node) + g_error))
        };
        for (axis, row) in [a, b].into_iter().enumerate() {
            let (from, to) = (row.least(simd, node) - error, row.greatest(simd, node) + error);
            let (from, to) = ((from * z_most).min(from * z_least), (to * z_most).max(to * z_least));
            let margin = from.abs().max(to.abs()) * splat(simd, ROUNDING);
            boxes.sides[2 * axis].store(from - margin);
            boxes.sides[2 * axis + 1].store(to + margin);
        }
        boxes
    }

    /// Bits of the boxes that may contain a ray of the tile.
    #[inline(always)]
    pub(super) fn overlapping<S: Simd, I: NodeFilter<S>>(&self, simd: S, rays: &TileRays) -> u32 {
        let union = rays.union;
        let [x_from, x_to] = [self.sides[0].load(simd), self.sides[1].load(simd)];
        let [y_from, y_to] = [self.sides[2].load(simd), self.sides[3].load(simd)];
        let mut overlap = x_from.simd_le(splat(simd, union[1]))
            & x_to.simd_ge(splat(simd, union[0]))
            & y_from.simd_le(splat(simd, union[3]))
            & y_to.simd_ge(splat(simd, union[2]));
        if I::ON_GRID && rays.on_grid {
            // Rays are at whole numbers plus a half, up to their error bound.
            let [a, b] = [0.5 - rays.error, 0.5 + rays.error].map(|half| splat(simd, half));
            overlap &= (x_to - a).floor().simd_ge(x_from - b) & (y_to - a).floor().simd_ge(y_from - b);
        }
        bits(overlap)
    }

    /// Bits of the blocks of rays that one box may matter to: their rectangles overlap it, and it is near enough.
    #[inline(always)]
    pub(super) fn blocks_of<S: Simd>(
        &self,
        simd: S,
        lane: usize,
        rays: &TileRays,
        least: &Lanes,
        blocks: u32,
    ) -> u32 {
        let [x_lo, x_hi, y_lo, y_hi] = &rays.bounds;
        let ([x_from, x_to, y_from, y_to], z_most) = self.get(lane);
        blocks
            & bits(
                x_hi.load(simd).simd_ge(splat(simd, x_from))
                    & x_lo.load(simd).simd_le(splat(simd, x_to))
                    & y_hi.load(simd).simd_ge(splat(simd, y_from))
                    & y_lo.load(simd).simd_le(splat(simd, y_to))
                    & least.load(simd).simd_le(splat(simd, z_most)),
            )
    }

    /// [`ProjectedBoxes::blocks_of`] for all boxes at once: one step a block of rays, not one a box.
    #[inline(always)]
    pub(super) fn blocks_of_all<S: Simd>(
        &self,
        simd: S,
        rays: &TileRays,
        least: &Lanes,
        blocks: u32,
    ) -> Indices {
        let [x_from, x_to] = [self.sides[0].load(simd), self.sides[1].load(simd)];
        let [y_from, y_to] = [self.sides[2].load(simd), self.sides[3].load(simd)];
        let z_most = self.z_most.load(simd);
        let none = u32x16::splat(simd, 0);
        let mut found = none;
        for block in each_bit(blocks) {
            let [x_lo, x_hi, y_lo, y_hi] = rays.around(block);
            let overlap = x_from.simd_le(splat(simd, x_hi))
                & x_to.simd_ge(splat(simd, x_lo))
                & y_from.simd_le(splat(simd, y_hi))
                & y_to.simd_ge(splat(simd, y_lo))
                & z_most.simd_ge(splat(simd, least.0[block]));
            found |= select_indices(overlap, u32x16::splat(simd, 1 << block), none);
        }
        let mut by_box = Indices::ZERO;
        by_box.store(found);
        by_box
    }

    /// Rectangle and greatest closeness of one box.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> ([f32; 4], f32) {
        let [x_from, x_to, y_from, y_to] = &self.sides;
        ([x_from.0[lane], x_to.0[lane], y_from.0[lane], y_to.0[lane]], self.z_most.0[lane])
    }
}
