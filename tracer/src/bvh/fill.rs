//! Full leaves and full nodes at the bottom of a binary tree.
//!
//! A builder for single rays divides down to single triangles, and every subtree of up to sixteen becomes a leaf,
//! with eleven on average. A tile pays for a leaf as a whole, so every third lane would be wasted. Therefore subtrees
//! of some thousand triangles are divided again from the top (`divide.rs`), only where leaves become full: sixteen
//! triangles per leaf, sixteen leaves per node, sixteen nodes per node above.
//!
//! Single rays gain by fuller leaves as well.

use rayon::prelude::*;

use super::build::Tree;
use super::divide::{Bounds, Division, Price};
use super::wide::{WIDTH, primitives_below, subtree_sizes};
use super::{Child, Node};
use crate::cancel::{Cancelled, IsCancelled, go_on};

/// Largest number of primitives of a subtree that is divided again: three full levels. Larger ones gained nothing.
const LARGEST: usize = WIDTH * WIDTH * WIDTH;

/// The tree with its bottom divided again where that is cheaper, into leaves of at most `leaf` primitives, most of
/// them full.
///
/// O(n log n), on all threads.
///
/// # Errors
/// [`Cancelled`]: `cancelled` is polled before each subtree.
pub(super) fn fill(
    tree: &Tree,
    boxes: &[Bounds],
    leaf: usize,
    cancelled: &IsCancelled<'_>,
) -> Result<Tree, Cancelled> {
    let price = Price::within(tree.nodes[0].bounds());
    let filling = Filling { tree, sizes: subtree_sizes(&tree.nodes), boxes, leaf, price };
    let root = Child::Inner(0);
    if filling.size(root) <= LARGEST {
        return Ok(filling.bottom(root, LARGEST));
    }
    let kept: Vec<u32> =
        (0..tree.nodes.len() as u32).filter(|&i| filling.size(Child::Inner(i)) > LARGEST).collect();
    let children = kept.iter().flat_map(|&node| [0, 1].map(|side| tree.nodes[node as usize].child(side)));
    let small: Vec<Child> =
        children.filter(|&child| child != Child::Empty && filling.size(child) <= LARGEST).collect();
    let bottom = |&child: &Child| go_on(cancelled).map(|()| filling.bottom(child, LARGEST));
    let bottoms = small.par_iter().map(bottom).collect::<Result<Vec<Tree>, Cancelled>>()?;
    Ok(filling.join(&kept, bottoms))
}

/// A tree whose bottom is filled.
struct Filling<'a> {
    tree: &'a Tree,
    /// Number of primitives below each node.
    sizes: Vec<u32>,
    boxes: &'a [Bounds],
    leaf: usize,
    price: Price,
}

impl Filling<'_> {
    fn size(&self, child: Child) -> usize {
        match child {
            Child::Empty => 0,
            Child::Inner(inner) => self.sizes[inner as usize] as usize,
            Child::Leaf { count, .. } => count as usize,
        }
    }

    /// The new subtree for a child of at most `limit` primitives. Where the old division is cheaper (a table top
    /// among its cups: the centres of large and small boxes are a bad criterion), its halves are treated the same way
    /// once they are a full level smaller.
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

    /// A child divided again, and the cost of its leaves.
    fn divided(&self, child: Child) -> (Tree, f32) {
        Division::of(primitives_below(self.tree, child), self.boxes, self.leaf, self.price)
    }

    /// Cost of the leaves that a child has without a new division.
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

    /// The kept nodes in their order, and below them the new bottoms in the order of traversal.
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
                    Child::Empty => continue,
                    _ => bottoms.next().map_or(Child::Empty, |bottom| joined.append(bottom, depth)),
                };
                joined.nodes[place].set(side, node.child_bounds(side), below);
            }
        }
        joined
    }
}

impl Tree {
    /// Appends the nodes of another tree, whose root gets the given depth, and returns the child for that root.
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

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::BuildQuality;
    use super::super::build::build;
    use super::*;
    use crate::cancel::never;

    /// Boxes on a bent sheet, as those of the triangles of a mesh.
    fn sheet(count: usize) -> Vec<Bounds> {
        let corner = |i: usize| {
            let (u, v) = ((i % 97) as f32, (i / 97) as f32);
            Vec3::new(u, v, (u * 0.2).sin() * 5.0)
        };
        (0..count).map(|i| (corner(i), corner(i) + 1.0)).collect()
    }

    /// Checks the tree: every primitive once, in boxes that contain it, children behind their parents. Returns the
    /// number of leaves.
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

    fn filled(boxes: &[Bounds]) -> Tree {
        let tree = build(boxes, BuildQuality::Default, &never).unwrap();
        fill(&tree, boxes, 16, &never).unwrap()
    }

    #[test]
    fn leaves_are_full() {
        for count in [1, 16, 17, 300, 4_096, 4_097, 30_000] {
            let boxes = sheet(count);
            let filled = filled(&boxes);
            let leaves = leaves_of(&filled, &boxes, 16);
            // There are few subtrees of fewer than a thousand, and each has one leaf that is not full.
            assert!(leaves as f64 <= (count as f64 / 15.5).ceil(), "{leaves} leaves for {count}");
        }
    }

    #[test]
    fn equal_boxes_are_divided() {
        let boxes = vec![(Vec3::ZERO, Vec3::ONE); 5_000];
        let filled = filled(&boxes);
        leaves_of(&filled, &boxes, 16);
    }
}
