//! Walks a tree along a ray, nearer child first, and hands leaves to the caller.
//!
//! The slab test is Kay and Kajiya's, with Ize's bound ("Robust BVH Ray Traversal", JCGT 2013) widened far enough
//! that a box is entered whenever the exact ray touches it, and whenever a primitive in it could tie with the best
//! hit so far. Which boxes are entered therefore never decides what is seen.

use std::ops::ControlFlow;

use glam::Vec3;

use super::{Child, MAX_DEPTH, Node};

/// Relative widening of the far side: Ize's 2 gamma(3), and room for distances that other code rounds elsewhere.
const SLACK: f32 = 1.0 + 4e-6;

/// A ray as boxes want it: o + t d, with the reciprocal of d.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RaySlabs {
    origin: Vec3,
    inverse: Vec3,
    negative: [bool; 3],
}

impl RaySlabs {
    /// Zero components of the direction are welcome: their reciprocal is infinite, and 0 * infinity is passed over.
    pub(crate) fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            inverse: Vec3::ONE / direction,
            negative: direction.to_array().map(|component| component.is_sign_negative()),
        }
    }

    /// Where the ray enters both children of a node, or infinity where it misses them within [0, `t_max`].
    #[inline(always)]
    fn enter(&self, node: &Node, t_max: f32) -> [f32; 2] {
        let mut near = [0.0_f32; 2];
        let mut far = [t_max; 2];
        for axis in 0..3 {
            let (lo, hi) = (node.lo[axis], node.hi[axis]);
            let (entry, exit) = if self.negative[axis] { (hi, lo) } else { (lo, hi) };
            for side in 0..2 {
                let t_entry = (entry[side] - self.origin[axis]) * self.inverse[axis];
                let t_exit = (exit[side] - self.origin[axis]) * self.inverse[axis];
                // Written so that a NaN (a ray inside the plane of a side) changes nothing.
                near[side] = if t_entry > near[side] { t_entry } else { near[side] };
                far[side] = if t_exit < far[side] { t_exit } else { far[side] };
            }
        }
        [0, 1].map(|side| if near[side] <= far[side] * SLACK { near[side] } else { f32::INFINITY })
    }
}

/// Calls `leaf(first, count)` for each leaf that the ray may touch within [0, `t_max`], nearer ones earlier. It answers
/// with the farthest distance that is still of interest, or stops the walk.
///
/// `nodes` must come from [`super::build`], which bounds the depth and with it the stack.
#[inline(always)]
pub(crate) fn traverse(
    nodes: &[Node],
    ray: &RaySlabs,
    mut t_max: f32,
    mut leaf: impl FnMut(u32, u32) -> ControlFlow<(), f32>,
) -> ControlFlow<()> {
    let mut stack = [(0_u32, 0.0_f32); MAX_DEPTH + 1];
    let mut depth = 0;
    let mut node = &nodes[0];
    loop {
        let entries = ray.enter(node, t_max);
        let nearer = usize::from(entries[1] < entries[0]);
        let mut next = None;
        for side in [nearer, 1 - nearer] {
            if entries[side] == f32::INFINITY || entries[side] > t_max * SLACK {
                continue;
            }
            match node.child(side) {
                Child::Empty => {}
                Child::Leaf { first, count } => t_max = leaf(first, count)?,
                Child::Inner(child) if next.is_none() => next = Some(child),
                Child::Inner(child) => {
                    stack[depth] = (child, entries[side]);
                    depth += 1;
                }
            }
        }
        while next.is_none() {
            if depth == 0 {
                return ControlFlow::Continue(());
            }
            depth -= 1;
            let (child, entry) = stack[depth];
            next = (entry <= t_max * SLACK).then_some(child);
        }
        node = next.map_or(node, |index| &nodes[index as usize]);
    }
}
