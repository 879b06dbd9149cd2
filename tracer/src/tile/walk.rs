//! A tile against the tree of a mesh.

use super::lens::{Frustum, Lens, ROUNDING};
use crate::bvh::{MAX_WIDE_DEPTH, WIDTH, WideChild, WideNode};
use crate::mesh::CompiledMesh;
use crate::simd::{Lanes, Simd, SimdBase, bits, each_bit, f32x16, fma, select, splat};

/// What a walk is for: whether a box is worth opening.
pub(super) trait Interest<S: Simd> {
    /// A box within this rectangle of the picture (x from and to, y from and to), nowhere closer than `z_most`.
    fn wants(&self, simd: S, around: [f32; 4], z_most: f32) -> bool;
}

/// A walk under way.
pub(super) struct Walk<'a> {
    nodes: &'a [WideNode],
    lens: &'a Lens,
    frustum: Frustum,
    stack: [(WideChild, f32); MAX_WIDE_DEPTH * (WIDTH - 1) + 1],
    height: usize,
}

impl<'a> Walk<'a> {
    #[inline(always)]
    pub(super) fn new(mesh: &'a CompiledMesh, lens: &'a Lens, union: [f32; 4]) -> Self {
        let stack = [(WideChild::Inner(0), f32::INFINITY); MAX_WIDE_DEPTH * (WIDTH - 1) + 1];
        Self { nodes: mesh.nodes(), lens, frustum: Frustum::new(lens, union), stack, height: 1 }
    }

    /// The next block of triangles whose box stands in the frustum at a closeness (1 / depth) of at least
    /// `least_closeness`, and is wanted; nearer ones earlier.
    #[inline(always)]
    pub(super) fn next<S: Simd>(
        &mut self,
        simd: S,
        interest: &impl Interest<S>,
        least_closeness: f32,
    ) -> Option<u32> {
        while self.height > 0 {
            self.height -= 1;
            let (child, z_most) = self.stack[self.height];
            if z_most < least_closeness {
                continue;
            }
            match child {
                WideChild::Inner(index) => {
                    self.open(simd, &self.nodes[index as usize], interest, least_closeness);
                }
                WideChild::Block(index) => return Some(index),
            }
        }
        None
    }

    #[inline(always)]
    fn open<S: Simd>(&mut self, simd: S, node: &WideNode, interest: &impl Interest<S>, least_closeness: f32) {
        let seen = in_sight(simd, node, &self.frustum);
        if seen == 0 {
            return;
        }
        let around = Around::new(simd, node, self.lens);
        let first = self.height;
        for lane in each_bit(seen) {
            let (rectangle, z_most) = around.get(lane);
            // A box that reaches behind the lens has no rectangle around it.
            if z_most < least_closeness
                || (z_most < f32::INFINITY && !interest.wants(simd, rectangle, z_most))
            {
                continue;
            }
            // Sorted so that the nearest ends on top.
            let mut at = self.height;
            while at > first && self.stack[at - 1].1 > z_most {
                self.stack[at] = self.stack[at - 1];
                at -= 1;
            }
            self.stack[at] = (node.child(lane), z_most);
            self.height += 1;
        }
    }
}

/// Which children stand in the frustum.
#[inline(always)]
fn in_sight<S: Simd>(simd: S, node: &WideNode, frustum: &Frustum) -> u32 {
    let mut outside = splat(simd, 0.0).simd_gt(splat(simd, 1.0));
    for side in 0..4 {
        let least = extreme(simd, node, frustum.planes[side], false);
        outside |= least.simd_gt(splat(simd, frustum.error[side]));
    }
    if !frustum.parallel {
        let farthest = extreme(simd, node, frustum.planes[4], true);
        outside |= farthest.simd_lt(splat(simd, -frustum.error[4]));
    }
    node.present() & !bits(outside)
}

/// Least (or greatest) value of a linear function over each box: at the corner against (or along) its gradient.
#[inline(always)]
fn extreme<S: Simd>(simd: S, node: &WideNode, plane: [f32; 4], greatest: bool) -> f32x16<S> {
    let mut sum = splat(simd, plane[3]);
    for axis in 0..3 {
        let corner = if (plane[axis] < 0.0) != greatest { &node.hi[axis] } else { &node.lo[axis] };
        sum = fma(splat(simd, plane[axis]), corner.load(simd), sum);
    }
    sum
}

/// Rectangles around the boxes of a node in the picture.
struct Around {
    sides: [Lanes; 4],
    z_most: Lanes,
}

impl Around {
    #[inline(always)]
    fn new<S: Simd>(simd: S, node: &WideNode, lens: &Lens) -> Self {
        let [a, b, g] = lens.rows;
        let one = splat(simd, 1.0);
        let [error, g_error] = [splat(simd, lens.error[0]), splat(simd, lens.error[1])];
        let nearest = extreme(simd, node, g, false) - g_error;
        let mut around = Self { sides: [Lanes::ZERO; 4], z_most: Lanes::ZERO };
        let (z_most, z_least) = if lens.parallel {
            around.z_most.store(-nearest);
            (one, one)
        } else {
            let z_most = one / nearest;
            let before = nearest.simd_gt(splat(simd, 0.0));
            let widened = z_most * splat(simd, 1.0 + 8.0 * ROUNDING);
            around.z_most.store(select(before, widened, splat(simd, f32::INFINITY)));
            (z_most, one / (extreme(simd, node, g, true) + g_error))
        };
        for (axis, row) in [a, b].into_iter().enumerate() {
            let (from, to) =
                (extreme(simd, node, row, false) - error, extreme(simd, node, row, true) + error);
            let (from, to) = ((from * z_most).min(from * z_least), (to * z_most).max(to * z_least));
            let margin = from.abs().max(to.abs()) * splat(simd, ROUNDING);
            around.sides[2 * axis].store(from - margin);
            around.sides[2 * axis + 1].store(to + margin);
        }
        around
    }

    /// Rectangle and greatest closeness of one box. If it reaches behind the lens, that is infinity, and the rectangle
    /// means nothing.
    #[inline(always)]
    fn get(&self, lane: usize) -> ([f32; 4], f32) {
        let [x_from, x_to, y_from, y_to] = &self.sides;
        ([x_from.0[lane], x_to.0[lane], y_from.0[lane], y_to.0[lane]], self.z_most.0[lane])
    }
}
