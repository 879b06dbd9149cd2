//! Full leaves, and full nodes, at the bottom of a binary tree.
//!
//! A builder for single rays goes down to single triangles, and any subtree of up to sixteen becomes a leaf: of eleven on
//! average. A tile pays for a leaf as a whole, so every third lane would be for nothing. Subtrees of some thousand
//! triangles are therefore divided anew, from above, only where leaves come out full: sixteen triangles a leaf, sixteen
//! leaves a node, sixteen nodes the next.
//!
//! Where to divide: a ray meets a box that is w by h in the picture by its area, w h. A tile with sides t meets it wherever it
//! overlaps: (w + t) (h + t) = w h + t (w + h) + t^2. So what a box costs is its area, and its edges times the tile's.
//! Single rays gain by the fuller leaves all the same.

use glam::Vec3;
use rayon::prelude::*;

use super::build::Tree;
use super::wide::{WIDTH, half_area, primitives_below, subtree_sizes};
use super::{Child, Node};

/// Least and greatest corner.
type Bounds = (Vec3, Vec3);

/// Subtrees of up to this many primitives are divided anew: three full levels. More gained nothing.
const LARGEST: usize = WIDTH * WIDTH * WIDTH;

/// Side of a tile, in shares of the mesh: of a mesh that fills a picture of sixty-four tiles.
const TILE: f32 = 1.0 / 64.0;

/// The same tree with its bottom divided anew where that is better, into leaves of at most `leaf` primitives, most of them full.
///
/// O(n log n), on all threads.
pub(super) fn fill(tree: &Tree, boxes: &[Bounds], leaf: usize) -> Tree {
    let (lo, hi) = tree.nodes[0].bounds();
    let price = Price { tile: (hi - lo).max_element() * TILE };
    let filling = Filling { tree, sizes: subtree_sizes(&tree.nodes), boxes, leaf, price };
    let root = Child::Inner(0);
    if filling.size(root) <= LARGEST {
        return filling.bottom(root, LARGEST);
    }
    let kept: Vec<u32> =
        (0..tree.nodes.len() as u32).filter(|&i| filling.size(Child::Inner(i)) > LARGEST).collect();
    let children = kept.iter().flat_map(|&node| [0, 1].map(|side| tree.nodes[node as usize].child(side)));
    let small: Vec<Child> = children.filter(|&child| filling.size(child) <= LARGEST).collect();
    let bottoms: Vec<Tree> = small.par_iter().map(|&child| filling.bottom(child, LARGEST)).collect();
    filling.join(&kept, bottoms)
}

/// A tree whose bottom is being filled.
struct Filling<'a> {
    tree: &'a Tree,
    /// Primitives below each node.
    sizes: Vec<u32>,
    boxes: &'a [Bounds],
    leaf: usize,
    price: Price,
}

/// What it costs that a box is met now and then.
#[derive(Clone, Copy)]
struct Price {
    /// Side of a tile.
    tile: f32,
}

impl Price {
    fn of(self, (lo, hi): Bounds) -> f32 {
        half_area((lo, hi)) + self.tile * (hi - lo).element_sum()
    }
}

impl Filling<'_> {
    fn size(&self, child: Child) -> usize {
        match child {
            Child::Empty => 0,
            Child::Inner(inner) => self.sizes[inner as usize] as usize,
            Child::Leaf { count, .. } => count as usize,
        }
    }

    /// What is below a child of no more than `limit` primitives, divided anew. Where the old way is better (a table's top among
    /// its cups: the centres of large and small boxes say little about where to divide), the same for its halves, as soon
    /// as they are a full level smaller.
    fn bottom(&self, child: Child, limit: usize) -> Tree {
        let size = self.size(child);
        if size <= limit {
            let (filled, cost) = self.divided(child);
            if size <= self.leaf || cost <= self.cost(child) {
                return filled;
            }
        }
        let Child::Inner(inner) = child else { return self.divided(child).0 };
        let node = &self.tree.nodes[inner as usize];
        let limit = if size <= limit { limit / WIDTH } else { limit };
        let mut joined = Tree::new(2 * size.div_ceil(self.leaf));
        joined.nodes.push(Node::EMPTY);
        for side in 0..2 {
            if node.child(side) != Child::Empty {
                let below = joined.append(self.bottom(node.child(side), limit), 2);
                joined.nodes[0].set(side, node.child_bounds(side), below);
            }
        }
        joined
    }

    /// What is below a child, divided anew, and the price of its leaves.
    fn divided(&self, child: Child) -> (Tree, f32) {
        let mut primitives = primitives_below(self.tree, child);
        let tree = Tree::new(2 * primitives.len().div_ceil(self.leaf));
        let mut division = Division { filling: self, tree, cost: 0.0, behind: Vec::new() };
        division.tree.nodes.push(Node::EMPTY);
        if primitives.len() <= self.leaf {
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

    /// The price of the leaves that a child would become as it is.
    fn cost(&self, child: Child) -> f32 {
        let mut cost = 0.0;
        let mut pending = vec![child];
        while let Some(child) = pending.pop() {
            let Child::Inner(inner) = child else { continue };
            let node = &self.tree.nodes[inner as usize];
            for side in 0..2 {
                let below = node.child(side);
                if self.size(below) > self.leaf {
                    pending.push(below);
                } else if below != Child::Empty {
                    cost += self.price.of(node.child_bounds(side));
                }
            }
        }
        cost
    }

    /// The kept nodes, in their order, and below them the new bottoms, in the order in which they are met.
    fn join(&self, kept: &[u32], bottoms: Vec<Tree>) -> Tree {
        let mut places = vec![0; self.tree.nodes.len()];
        for (place, &node) in (0_u32..).zip(kept) {
            places[node as usize] = place;
        }
        let mut depths = vec![1; kept.len()];
        let mut joined =
            Tree::new(kept.len() + bottoms.iter().map(|bottom| bottom.nodes.len()).sum::<usize>());
        joined.nodes.resize(kept.len(), Node::EMPTY);
        let mut bottoms = bottoms.into_iter();
        for (place, &node) in kept.iter().enumerate() {
            let node = &self.tree.nodes[node as usize];
            let depth = depths[place] + 1;
            for side in 0..2 {
                let below = match node.child(side) {
                    child @ Child::Inner(inner) if self.size(child) > LARGEST => {
                        depths[places[inner as usize] as usize] = depth;
                        Child::Inner(places[inner as usize])
                    }
                    _ => bottoms.next().map_or(Child::Empty, |bottom| joined.append(bottom, depth)),
                };
                joined.nodes[place].set(side, node.child_bounds(side), below);
            }
        }
        joined
    }
}

impl Tree {
    /// Adds the nodes of another tree, whose root comes to stand at some depth, and names that root.
    fn append(&mut self, other: Tree, depth: u32) -> Child {
        let (nodes, primitives) = (self.nodes.len() as u32, self.order.len() as u32);
        self.depth = self.depth.max(depth + other.depth - 1);
        self.order.extend(other.order);
        for node in other.nodes {
            let mut moved = Node::EMPTY;
            for side in 0..2 {
                let child = match node.child(side) {
                    Child::Empty => continue,
                    Child::Inner(inner) => Child::Inner(inner + nodes),
                    Child::Leaf { first, count } => Child::Leaf { first: first + primitives, count },
                };
                moved.set(side, node.child_bounds(side), child);
            }
            self.nodes.push(moved);
        }
        Child::Inner(nodes)
    }
}

/// Some primitives being divided.
struct Division<'a> {
    filling: &'a Filling<'a>,
    tree: Tree,
    /// Of the leaves.
    cost: f32,
    /// Prices of the boxes around what stands behind each place.
    behind: Vec<f32>,
}

impl Division<'_> {
    /// Divides more primitives than a leaf takes between the sides of a node.
    fn divide(&mut self, node: u32, primitives: &mut [u32], depth: u32) {
        self.tree.depth = self.tree.depth.max(depth);
        let at = self.arrange(primitives);
        let (left, right) = primitives.split_at_mut(at);
        self.hang(node, 0, left, depth);
        self.hang(node, 1, right, depth);
    }

    /// Makes primitives one side of a node.
    fn hang(&mut self, node: u32, side: usize, primitives: &mut [u32], depth: u32) {
        let bounds = primitives.iter().fold(EMPTY, |bounds, &primitive| self.filling.with(bounds, primitive));
        let child = if primitives.len() <= self.filling.leaf {
            self.cost += self.filling.price.of(bounds);
            self.tree.leaf(primitives.iter().copied())
        } else {
            let inner = self.tree.nodes.len() as u32;
            self.tree.nodes.push(Node::EMPTY);
            self.divide(inner, primitives, depth + 1);
            Child::Inner(inner)
        };
        self.tree.nodes[node as usize].set(side, bounds, child);
    }

    /// Puts primitives in the order along the axis where dividing them costs least, and tells where that is.
    fn arrange(&mut self, primitives: &mut [u32]) -> usize {
        let unit = unit_of(primitives.len(), self.filling.leaf);
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

    /// By centre along an axis, then by number.
    fn sorted(&self, primitives: &[u32], axis: usize) -> Vec<u32> {
        let key = |&primitive: &u32| {
            let (lo, hi) = self.filling.boxes[primitive as usize];
            u64::from(in_order(lo[axis] + hi[axis])) << 32 | u64::from(primitive)
        };
        let mut keys: Vec<u64> = primitives.iter().map(key).collect();
        keys.sort_unstable();
        keys.into_iter().map(|key| key as u32).collect()
    }

    /// Where to divide so that one side is made of full units, and the least sum of prices times leaves.
    fn cheapest(&mut self, sorted: &[u32], unit: usize) -> (f32, usize) {
        let Filling { leaf, price, .. } = *self.filling;
        let count = sorted.len();
        let leaves = |primitives: usize| primitives.div_ceil(leaf) as f32;
        self.behind.resize(count, 0.0);
        let mut bounds = EMPTY;
        for at in (1..count).rev() {
            bounds = self.filling.with(bounds, sorted[at]);
            self.behind[at] = price.of(bounds);
        }
        let mut best = (f32::INFINITY, unit);
        bounds = EMPTY;
        for at in 1..count {
            bounds = self.filling.with(bounds, sorted[at - 1]);
            if at % unit == 0 || (count - at) % unit == 0 {
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

/// Primitives of the largest full leaf, or full subtree of sixteen times as many, that is smaller than `count`.
fn unit_of(count: usize, leaf: usize) -> usize {
    let mut unit = leaf;
    while unit * WIDTH < count {
        unit *= WIDTH;
    }
    unit
}

/// Bits that are ordered as the numbers are.
fn in_order(number: f32) -> u32 {
    let bits = number.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

#[cfg(test)]
mod tests {
    use super::super::BuildQuality;
    use super::super::build::build;
    use super::*;

    /// Boxes on a bent sheet, as triangles of a mesh stand.
    fn sheet(count: usize) -> Vec<Bounds> {
        let corner = |i: usize| {
            let (u, v) = ((i % 97) as f32, (i / 97) as f32);
            Vec3::new(u, v, (u * 0.2).sin() * 5.0)
        };
        (0..count).map(|i| (corner(i), corner(i) + 1.0)).collect()
    }

    /// Goes through the tree: every primitive once, in boxes that hold it, children behind their parents. How many leaves.
    fn leaves_of(tree: &Tree, boxes: &[Bounds], leaf: usize) -> usize {
        let mut seen = vec![0; boxes.len()];
        let mut leaves = 0;
        let mut pending = vec![(0_u32, 1_u32)];
        let mut deepest = 0;
        while let Some((index, depth)) = pending.pop() {
            deepest = deepest.max(depth);
            let node = &tree.nodes[index as usize];
            for side in 0..2 {
                let (lo, hi) = node.child_bounds(side);
                match node.child(side) {
                    Child::Empty => {}
                    Child::Inner(inner) => {
                        assert!(inner > index);
                        pending.push((inner, depth + 1));
                    }
                    Child::Leaf { first, count } => {
                        assert!((1..=leaf).contains(&(count as usize)));
                        leaves += 1;
                        for &primitive in &tree.order[first as usize..(first + count) as usize] {
                            seen[primitive as usize] += 1;
                            let (a, b) = boxes[primitive as usize];
                            assert!(lo.cmple(a).all() && hi.cmpge(b).all());
                        }
                    }
                }
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
        assert_eq!(deepest, tree.depth);
        leaves
    }

    #[test]
    fn leaves_are_full() {
        for count in [1, 16, 17, 300, 4_096, 4_097, 30_000] {
            let boxes = sheet(count);
            let filled = fill(&build(&boxes, BuildQuality::Default), &boxes, 16);
            let leaves = leaves_of(&filled, &boxes, 16);
            // Subtrees of fewer than a thousand are few, and each has one leaf that is not full.
            assert!(leaves as f64 <= (count as f64 / 15.5).ceil(), "{leaves} leaves for {count}");
        }
    }

    #[test]
    fn boxes_in_one_place_are_divided_all_the_same() {
        let boxes = vec![(Vec3::ZERO, Vec3::ONE); 5_000];
        let filled = fill(&build(&boxes, BuildQuality::Default), &boxes, 16);
        leaves_of(&filled, &boxes, 16);
    }

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
