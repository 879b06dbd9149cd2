//! A tile against the tree of a mesh.

use super::lens::Frustum;
use crate::bvh::{MAX_WIDE_DEPTH, WIDTH, WideChild, WideNode};
use crate::mesh::CompiledMesh;
use crate::simd::{Simd, SimdBase, bits, each_bit, f32x16, fma, splat};

/// A walk under way.
pub(super) struct Walk<'a> {
    nodes: &'a [WideNode],
    frustum: Frustum,
    stack: [(WideChild, f32); MAX_WIDE_DEPTH * (WIDTH - 1) + 1],
    height: usize,
}

impl<'a> Walk<'a> {
    #[inline(always)]
    pub(super) fn new(mesh: &'a CompiledMesh, frustum: Frustum) -> Self {
        let stack = [(WideChild::Inner(0), 0.0_f32); MAX_WIDE_DEPTH * (WIDTH - 1) + 1];
        Self { nodes: mesh.nodes(), frustum, stack, height: 1 }
    }

    /// The next block of triangles whose box may stand in the frustum at a closeness (1 / depth) of at least
    /// `least_closeness`; nearer ones earlier.
    #[inline(always)]
    pub(super) fn next<S: Simd>(&mut self, simd: S, least_closeness: f32) -> Option<u32> {
        while self.height > 0 {
            self.height -= 1;
            let (child, depth) = self.stack[self.height];
            if depth * least_closeness > 1.0 {
                continue;
            }
            match child {
                WideChild::Inner(index) => self.open(simd, &self.nodes[index as usize], least_closeness),
                WideChild::Block(index) => return Some(index),
            }
        }
        None
    }

    #[inline(always)]
    fn open<S: Simd>(&mut self, simd: S, node: &WideNode, least_closeness: f32) {
        let (seen, depths) = in_sight(simd, node, &self.frustum, least_closeness);
        let first = self.height;
        for lane in each_bit(seen) {
            // Sorted so that the nearest ends on top.
            let mut at = self.height;
            while at > first && self.stack[at - 1].1 < depths[lane] {
                self.stack[at] = self.stack[at - 1];
                at -= 1;
            }
            self.stack[at] = (node.child(lane), depths[lane]);
            self.height += 1;
        }
    }
}

/// Which children may be seen, and a depth that nothing in them is nearer than.
#[inline(always)]
fn in_sight<S: Simd>(
    simd: S,
    node: &WideNode,
    frustum: &Frustum,
    least_closeness: f32,
) -> (u32, [f32; WIDTH]) {
    let mut outside = splat(simd, 0.0).simd_gt(splat(simd, 1.0));
    for side in 0..4 {
        let least = extreme(simd, node, frustum.planes[side], false);
        outside |= least.simd_gt(splat(simd, frustum.error[side]));
    }
    let slack = splat(simd, frustum.error[4]);
    let nearest = extreme(simd, node, frustum.planes[4], false) - slack;
    let farthest = extreme(simd, node, frustum.planes[4], true) + slack;
    let depth = nearest.max(splat(simd, 0.0));
    let hidden =
        (depth * splat(simd, least_closeness)).simd_gt(splat(simd, 1.0)) | farthest.simd_lt(splat(simd, 0.0));
    (node.present() & !bits(outside | hidden), depth.to_array())
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
