//! Triangles that a ray may hit: a tree of boxes, each somewhat larger than the triangles in it.
//!
//! A triangle is left out only if the ray misses a box around it by more than 10^-9 of the coordinates, a million times what the
//! formulas of `shape` round. The exception is a ray in the plane of a triangle: its determinant is rounding noise, and so is
//! a hit outside the box.

use glam::DVec3;

use super::shape::{Primitive, Shape};

/// Part of the largest coordinate by which a box is larger than its triangles.
const MARGIN: f64 = 1e-9;

/// Most triangles of a box that is not divided.
const MOST_OF_LEAF: usize = 4;

/// The primitives of a scene: triangles in boxes, and all others.
pub(super) struct Boxes {
    root: Node,
    /// Indices of primitives that every ray is tested against, ascending.
    always: Vec<usize>,
}

struct Node {
    lo: DVec3,
    hi: DVec3,
    content: Content,
}

enum Content {
    /// Indices of primitives.
    Leaf(Vec<usize>),
    Halves(Box<[Node; 2]>),
}

impl Boxes {
    /// Triangles are halved at the median of their centres, along the axis on which these are spread widest, until few remain.
    pub(super) fn new(primitives: &[Primitive]) -> Self {
        let is_triangle = |index: &usize| matches!(primitives[*index].shape, Shape::Triangle { .. });
        let (triangles, always) = (0..primitives.len()).partition(is_triangle);
        Self { root: Node::new(primitives, triangles), always }
    }

    /// No box: every ray is tested against every primitive.
    #[cfg(test)]
    pub(super) fn none(primitives: &[Primitive]) -> Self {
        Self { root: Node::new(primitives, Vec::new()), always: (0..primitives.len()).collect() }
    }

    /// Indices of the primitives that a ray may hit, ascending: results do not depend on the tree.
    pub(super) fn candidates(&self, origin: DVec3, direction: DVec3) -> Vec<usize> {
        let mut found = self.always.clone();
        self.root.collect(origin, direction, &mut found);
        found.sort_unstable();
        found
    }
}

impl Node {
    fn new(primitives: &[Primitive], mut indices: Vec<usize>) -> Self {
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut first, mut last) = (lo, hi);
        for &index in &indices {
            let corners = corners(&primitives[index]);
            lo = corners.iter().fold(lo, |lo, corner| lo.min(*corner));
            hi = corners.iter().fold(hi, |hi, corner| hi.max(*corner));
            let center = center(&primitives[index]);
            (first, last) = (first.min(center), last.max(center));
        }
        if indices.len() <= MOST_OF_LEAF {
            return Self { lo, hi, content: Content::Leaf(indices) };
        }
        let axis = (last - first).max_position();
        let along = |index: &usize| center(&primitives[*index])[axis];
        indices.sort_unstable_by(|a, b| along(a).total_cmp(&along(b)));
        let upper = indices.split_off(indices.len() / 2);
        let halves = [indices, upper].map(|half| Self::new(primitives, half));
        Self { lo, hi, content: Content::Halves(Box::new(halves)) }
    }

    fn collect(&self, origin: DVec3, direction: DVec3, found: &mut Vec<usize>) {
        if !self.may_be_hit(origin, direction) {
            return;
        }
        match &self.content {
            Content::Leaf(indices) => found.extend(indices),
            Content::Halves(halves) => halves.iter().for_each(|half| half.collect(origin, direction, found)),
        }
    }

    /// Whether a ray with t >= 0 comes as near as the margin to the box. Also true where a number is NaN.
    fn may_be_hit(&self, origin: DVec3, direction: DVec3) -> bool {
        let largest = |point: DVec3| point.abs().max_element();
        let margin = MARGIN * (largest(self.lo).max(largest(self.hi)) + largest(origin));
        let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let (below, above) =
                (self.lo[axis] - margin - origin[axis], self.hi[axis] + margin - origin[axis]);
            if direction[axis] == 0.0 {
                if below > 0.0 || above < 0.0 {
                    return false;
                }
                continue;
            }
            let (a, b) = (below / direction[axis], above / direction[axis]);
            (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
        }
        !(enters > leaves)
    }
}

fn corners(primitive: &Primitive) -> [DVec3; 3] {
    match primitive.shape {
        Shape::Triangle { corners, .. } => corners,
        Shape::Sphere { center, .. } | Shape::Disk { center, .. } => [center; 3],
        Shape::Plane { point, .. } => [point; 3],
    }
}

fn center(primitive: &Primitive) -> DVec3 {
    let [a, b, c] = corners(primitive);
    (a + b + c) / 3.0
}
