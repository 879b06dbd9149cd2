//! Top-down division of some primitives into full leaves.
//!
//! Cost: a ray meets a box of w by h in the picture in proportion to its area, w h. A tile with sides t meets it
//! wherever they overlap: (w + t) (h + t) = w h + t (w + h) + t^2. So the cost of a box is its area plus its edges
//! times the tile's side. Among the divisions with full leaves (or full nodes) on one side, the one with the least
//! sum of cost times number of leaves is taken.

use glam::Vec3;

use super::build::Tree;
use super::wide::{WIDTH, half_area};
use super::{Child, Node};

/// Lower and upper corner.
pub(super) type Bounds = (Vec3, Vec3);

/// Side of a tile in shares of the mesh, for a mesh that fills a picture of sixty-four tiles.
const TILE: f32 = 1.0 / 64.0;

/// Cost of boxes for tiles of one size.
#[derive(Clone, Copy)]
pub(super) struct Price {
    /// Side of a tile, in units of the mesh.
    tile: f32,
}

impl Price {
    /// Tiles for a mesh with this bounding box.
    pub(super) fn within((lo, hi): Bounds) -> Self {
        Self { tile: (hi - lo).max_element() * TILE }
    }

    pub(super) fn of(self, (lo, hi): Bounds) -> f32 {
        half_area((lo, hi)) + self.tile * (hi - lo).element_sum()
    }
}

/// The division of some primitives.
pub(super) struct Division<'a> {
    /// Boxes of all primitives.
    boxes: &'a [Bounds],
    /// Primitives in a full leaf.
    leaf: usize,
    price: Price,
    tree: Tree,
    /// Sum of the costs of all leaves.
    cost: f32,
    /// Costs of the boxes around everything behind each position.
    behind: Vec<f32>,
}

impl<'a> Division<'a> {
    /// The tree over some primitives, and the cost of its leaves.
    pub(super) fn of(
        mut primitives: Vec<u32>,
        boxes: &'a [Bounds],
        leaf: usize,
        price: Price,
    ) -> (Tree, f32) {
        let tree = Tree::new(2 * primitives.len().div_ceil(leaf));
        let mut division = Self { boxes, leaf, price, tree, cost: 0.0, behind: Vec::new() };
        division.tree.nodes.push(Node::EMPTY);
        if primitives.len() <= leaf {
            division.hang(0, 0, &mut primitives, 1);
        } else {
            division.divide(0, &mut primitives, 1);
        }
        (division.tree, division.cost)
    }

    fn with(&self, (lo, hi): Bounds, primitive: u32) -> Bounds {
        let (other_lo, other_hi) = self.boxes[primitive as usize];
        (lo.min(other_lo), hi.max(other_hi))
    }

    /// Divides more primitives than a leaf has between the sides of a node.
    fn divide(&mut self, node: u32, primitives: &mut [u32], depth: u32) {
        self.tree.depth = self.tree.depth.max(depth);
        let at = self.arrange(primitives);
        let (left, right) = primitives.split_at_mut(at);
        self.hang(node, 0, left, depth);
        self.hang(node, 1, right, depth);
    }

    /// Makes primitives one side of a node.
    fn hang(&mut self, node: u32, side: usize, primitives: &mut [u32], depth: u32) {
        let bounds = primitives.iter().fold(EMPTY, |bounds, &primitive| self.with(bounds, primitive));
        let child = if primitives.len() <= self.leaf {
            self.cost += self.price.of(bounds);
            self.tree.leaf(primitives.iter().copied())
        } else {
            let inner = self.tree.nodes.len() as u32;
            self.tree.nodes.push(Node::EMPTY);
            self.divide(inner, primitives, depth + 1);
            Child::Inner(inner)
        };
        self.tree.nodes[node as usize].set(side, bounds, child);
    }

    /// Sorts primitives along the axis of the cheapest division, and returns the position of the division.
    fn arrange(&mut self, primitives: &mut [u32]) -> usize {
        let unit = unit_of(primitives.len(), self.leaf);
        let mut best: Option<(f32, usize, Vec<u32>)> = None;
        for axis in 0..3 {
            let sorted = self.sorted(primitives, axis);
            let (cost, at) = self.cheapest(&sorted, unit);
            if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
                best = Some((cost, at, sorted));
            }
        }
        let Some((_, at, sorted)) = best else { return unit };
        primitives.copy_from_slice(&sorted);
        at
    }

    /// Primitives in the order of their centres along an axis, then of their indices.
    fn sorted(&self, primitives: &[u32], axis: usize) -> Vec<u32> {
        let key = |&primitive: &u32| {
            let (lo, hi) = self.boxes[primitive as usize];
            u64::from(in_order(lo[axis] + hi[axis])) << 32 | u64::from(primitive)
        };
        let mut keys: Vec<u64> = primitives.iter().map(key).collect();
        keys.sort_unstable();
        keys.into_iter().map(|key| key as u32).collect()
    }

    /// The cheapest division with full units on one side: the least sum of costs times leaves, and its position.
    fn cheapest(&mut self, sorted: &[u32], unit: usize) -> (f32, usize) {
        let Self { leaf, price, .. } = *self;
        let count = sorted.len();
        let leaves = |primitives: usize| primitives.div_ceil(leaf) as f32;
        self.behind.resize(count, 0.0);
        let mut bounds = EMPTY;
        for at in (1..count).rev() {
            bounds = self.with(bounds, sorted[at]);
            self.behind[at] = price.of(bounds);
        }
        let mut best = (f32::INFINITY, unit);
        bounds = EMPTY;
        for at in 1..count {
            bounds = self.with(bounds, sorted[at - 1]);
            if at.is_multiple_of(unit) || (count - at).is_multiple_of(unit) {
                let cost = price.of(bounds) * leaves(at) + self.behind[at] * leaves(count - at);
                if cost < best.0 {
                    best = (cost, at);
                }
            }
        }
        best
    }
}

const EMPTY: Bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);

/// Primitives of the largest full leaf, or full subtree of a power of sixteen leaves, with fewer than `count`.
fn unit_of(count: usize, leaf: usize) -> usize {
    let mut unit = leaf;
    while unit * WIDTH < count {
        unit *= WIDTH;
    }
    unit
}

/// Bits of a number, in the order of the numbers.
fn in_order(number: f32) -> u32 {
    let bits = number.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_sort_as_their_bits_do() {
        let numbers = [f32::NEG_INFINITY, -2.0, -1e-40, 0.0, 1e-40, 1.0, f32::INFINITY];
        assert!(numbers.windows(2).all(|pair| in_order(pair[0]) < in_order(pair[1])));
    }

    #[test]
    fn units_are_full_subtrees() {
        assert_eq!([17, 256, 257, 4_096, 4_097].map(|count| unit_of(count, 16)), [16, 16, 256, 256, 4_096]);
    }
}
