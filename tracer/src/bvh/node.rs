//! The node of a binary tree. It holds the boxes of its two children, so that one cache line decides between them
//! (Aila and Laine, "Understanding the Efficiency of Ray Traversal on GPUs", HPG 2009).

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A node of a binary tree with two children. Bounds are indexed `[axis][child]`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// Lower corner of each child's box.
    pub lo: [[f32; 2]; 3],
    /// Upper corner of each child's box.
    pub hi: [[f32; 2]; 3],
    /// Inner child: index of its node. Leaf: its first primitive.
    pub first: [u32; 2],
    /// Inner child: 0. Leaf: its number of primitives.
    pub count: [u32; 2],
}

const _: () = assert!(size_of::<Node>() == 64);

/// One side of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Child {
    /// Empty: only in the root of a tree with a single leaf.
    Empty,
    /// The node with this index.
    Inner(u32),
    /// `count` primitives from `first` on.
    Leaf {
        /// First primitive.
        first: u32,
        /// Number of primitives, at least one.
        count: u32,
    },
}

impl Node {
    /// A node without children: boxes that no ray enters.
    pub(crate) const EMPTY: Node =
        Node { lo: [[f32::INFINITY; 2]; 3], hi: [[f32::NEG_INFINITY; 2]; 3], first: [0; 2], count: [0; 2] };

    /// Sets a child and its box on one side.
    pub(crate) fn set(&mut self, side: usize, (lo, hi): (Vec3, Vec3), child: Child) {
        self.set_bounds(side, (lo, hi));
        (self.first[side], self.count[side]) = match child {
            Child::Empty => (0, 0),
            Child::Inner(node) => (node, 0),
            Child::Leaf { first, count } => (first, count),
        };
    }

    /// Sets the box of one side.
    pub(crate) fn set_bounds(&mut self, side: usize, (lo, hi): (Vec3, Vec3)) {
        for axis in 0..3 {
            self.lo[axis][side] = lo[axis];
            self.hi[axis][side] = hi[axis];
        }
    }

    /// The child on one side. Node 0 is the root, so no child is node 0.
    pub(crate) fn child(&self, side: usize) -> Child {
        match (self.first[side], self.count[side]) {
            (0, 0) => Child::Empty,
            (node, 0) => Child::Inner(node),
            (first, count) => Child::Leaf { first, count },
        }
    }

    /// The box of one side.
    pub(crate) fn child_bounds(&self, side: usize) -> (Vec3, Vec3) {
        let corner = |bounds: &[[f32; 2]; 3]| Vec3::new(bounds[0][side], bounds[1][side], bounds[2][side]);
        (corner(&self.lo), corner(&self.hi))
    }

    /// The box around both sides.
    pub(crate) fn bounds(&self) -> (Vec3, Vec3) {
        let [a, b] = [self.child_bounds(0), self.child_bounds(1)];
        (a.0.min(b.0), a.1.max(b.1))
    }
}
