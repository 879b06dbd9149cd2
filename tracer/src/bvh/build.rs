//! Building of binary trees: boxes are clustered (`cluster.rs`), nodes reinserted (`reinsert.rs`), and the tree laid
//! out depth first.

use glam::Vec3;
use obvhs::bvh2::Bvh2;

use super::cluster::Clustering;
use super::divide::Bounds;
use super::fill::fill;
use super::reinsert::improve;
use super::wide::{WideTree, widen, widen_evenly};
use super::{Child, MAX_DEPTH, MAX_WIDE_DEPTH, Node};
use crate::cancel::{Cancelled, IsCancelled, go_on};

/// A binary tree, and the order of its primitives in the leaves.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    /// Nodes, the root first, children after their parents.
    pub nodes: Vec<Node>,
    /// The primitive at each position of the leaves.
    pub order: Vec<u32>,
    /// Number of edges on the longest path from the root to a leaf.
    pub depth: u32,
}

/// Effort of building a tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildQuality {
    /// Fast, for meshes that are traced a few times.
    Fast,
    /// The point beyond which more effort gains little.
    #[default]
    Default,
    /// Several times the effort of the default, for meshes that are compiled once and traced often.
    High,
}

/// Parameters of a build.
pub(super) struct Effort {
    pub clustering: Clustering,
    /// Shares of the nodes that each series of passes tries: see [`improve`].
    pub reinsertion: &'static [f32],
}

impl BuildQuality {
    pub(super) fn effort(self) -> Effort {
        let (clustering, reinsertion): (_, &[f32]) = match self {
            BuildQuality::Fast => (Clustering { reach: 1, short_rounds: 0, fine_order: false }, &[0.01]),
            BuildQuality::Default => {
                (Clustering { reach: 14, short_rounds: 3, fine_order: false }, &[0.05, 0.1])
            }
            BuildQuality::High => (Clustering { reach: 14, short_rounds: 1, fine_order: true }, &[1.0, 1.0]),
        };
        Effort { clustering, reinsertion }
    }
}

/// Primitives per leaf of the median build.
const MEDIAN_LEAF: usize = 4;

/// Builds a tree over boxes (lower and upper corner; finite, within 1e15). Without boxes it is an empty root.
///
/// The time is O(n log n). Where the surface area heuristic results in a tree deeper than [`MAX_DEPTH`] (boxes that
/// double in size), the tree is built by the median, whose depth is logarithmic for all boxes.
pub(super) fn build(
    boxes: &[Bounds],
    quality: BuildQuality,
    cancelled: &IsCancelled<'_>,
) -> Result<Tree, Cancelled> {
    if boxes.is_empty() {
        return Ok(Tree { nodes: vec![Node::EMPTY], order: Vec::new(), depth: 1 });
    }
    let Effort { clustering, reinsertion } = quality.effort();
    let (mut source, _) = clustering.of(boxes, cancelled)?;
    improve(&mut source, reinsertion, cancelled)?;
    go_on(cancelled)?;
    Ok(lay_out(&source).unwrap_or_else(|| median(boxes)))
}

/// Builds a tree of sixteen children per node, with at most `leaf` primitives per leaf, most leaves full. Where it is
/// deeper than [`MAX_WIDE_DEPTH`], it is built by the median, as in [`build`].
///
/// # Errors
/// [`Cancelled`]: `cancelled` is polled between steps, each a fraction of the work.
pub(crate) fn build_wide(
    boxes: &[Bounds],
    leaf: usize,
    quality: BuildQuality,
    cancelled: &IsCancelled<'_>,
) -> Result<WideTree, Cancelled> {
    let tree = build(boxes, quality, cancelled)?;
    // Leaves of single primitives are always full.
    let tree = if leaf > 1 { fill(&tree, boxes, leaf, cancelled)? } else { tree };
    go_on(cancelled)?;
    let wide = widen(&tree, leaf);
    Ok(if wide.depth as usize <= MAX_WIDE_DEPTH { wide } else { widen_evenly(&median(boxes), leaf) })
}

impl Tree {
    /// An empty tree with room for `capacity` nodes and primitives.
    pub(super) fn new(capacity: usize) -> Self {
        Self { nodes: Vec::with_capacity(capacity), order: Vec::with_capacity(capacity), depth: 1 }
    }

    /// Adds a leaf's primitives and returns the child for it.
    pub(super) fn leaf(&mut self, primitives: impl IntoIterator<Item = u32>) -> Child {
        let first = self.order.len() as u32;
        self.order.extend(primitives);
        Child::Leaf { first, count: self.order.len() as u32 - first }
    }
}

/// Copies a tree of `obvhs` in depth-first order. `None` where it is deeper than [`MAX_DEPTH`].
fn lay_out(source: &Bvh2) -> Option<Tree> {
    let mut tree = Tree::new(source.nodes.len() / 2 + 1);
    let bounds = |index: u32| {
        let node = &source.nodes[index as usize];
        (node.min, node.max)
    };
    if source.nodes[0].is_leaf() {
        let leaf = tree.leaf(leaf_of(source, 0));
        let mut root = Node::EMPTY;
        root.set(0, bounds(0), leaf);
        tree.nodes.push(root);
        return Some(tree);
    }
    // (node of the source, where to write its index: parent and side, depth)
    let mut pending = vec![(0_u32, None::<(u32, usize)>, 1_u32)];
    while let Some((index, parent, depth)) = pending.pop() {
        if depth as usize > MAX_DEPTH {
            return None;
        }
        tree.depth = tree.depth.max(depth);
        let own = tree.nodes.len() as u32;
        if let Some((parent, side)) = parent {
            tree.nodes[parent as usize].first[side] = own;
        }
        tree.nodes.push(Node::EMPTY);
        let left = source.nodes[index as usize].first_index;
        for (side, child) in [(0, left), (1, left + 1)] {
            let is_leaf = source.nodes[child as usize].is_leaf();
            let link = if is_leaf { tree.leaf(leaf_of(source, child)) } else { Child::Inner(0) };
            tree.nodes[own as usize].set(side, bounds(child), link);
        }
        // The right child is pushed first, so that the left one follows its parent in memory.
        for (side, child) in [(1, left + 1), (0, left)] {
            if !source.nodes[child as usize].is_leaf() {
                pending.push((child, Some((own, side)), depth + 1));
            }
        }
    }
    Some(tree)
}

fn leaf_of(source: &Bvh2, index: u32) -> impl Iterator<Item = u32> {
    let node = &source.nodes[index as usize];
    let first = node.first_index as usize;
    source.primitive_indices[first..first + node.prim_count as usize].iter().copied()
}

/// Halves the boxes by the median of their centres along the widest axis, recursively, down to [`MEDIAN_LEAF`] boxes.
fn median(boxes: &[Bounds]) -> Tree {
    let mut tree = Tree::new(boxes.len());
    let mut indices: Vec<u32> = (0..boxes.len() as u32).collect();
    tree.nodes.push(Node::EMPTY);
    if indices.len() <= MEDIAN_LEAF {
        let bounds = bounds_of(boxes, &indices);
        let leaf = tree.leaf(indices);
        tree.nodes[0].set(0, bounds, leaf);
    } else {
        split(boxes, &mut indices, &mut tree, 0, 1);
    }
    tree
}

fn split(boxes: &[Bounds], indices: &mut [u32], tree: &mut Tree, own: usize, depth: u32) {
    tree.depth = tree.depth.max(depth);
    let center = |i: u32| boxes[i as usize].0 + boxes[i as usize].1;
    let (lo, hi) = indices
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), &i| (lo.min(center(i)), hi.max(center(i))));
    let axis = (hi - lo).max_position();
    let middle = indices.len() / 2;
    let key = |&i: &u32| (center(i)[axis], i);
    indices.select_nth_unstable_by(middle, |a, b| {
        let ((ka, ia), (kb, ib)) = (key(a), key(b));
        ka.total_cmp(&kb).then(ia.cmp(&ib))
    });
    let (left, right) = indices.split_at_mut(middle);
    for (side, half) in [left, right].into_iter().enumerate() {
        let bounds = bounds_of(boxes, half);
        if half.len() <= MEDIAN_LEAF {
            let leaf = tree.leaf(half.iter().copied());
            tree.nodes[own].set(side, bounds, leaf);
        } else {
            let node = tree.nodes.len();
            tree.nodes.push(Node::EMPTY);
            tree.nodes[own].set(side, bounds, Child::Inner(node as u32));
            split(boxes, half, tree, node, depth + 1);
        }
    }
}

fn bounds_of(boxes: &[Bounds], indices: &[u32]) -> Bounds {
    indices.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), &i| {
        (lo.min(boxes[i as usize].0), hi.max(boxes[i as usize].1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cancel::never;

    fn grid(n: usize) -> Vec<(Vec3, Vec3)> {
        (0..n)
            .map(|i| {
                let corner = Vec3::new((i % 17) as f32, (i / 17 % 13) as f32, (i / 221) as f32);
                (corner, corner + 0.9)
            })
            .collect()
    }

    /// Checks the whole tree: children follow their parents, boxes contain everything below, leaves cover the order
    /// once.
    fn check(tree: &Tree, count: usize) {
        let mut covered = vec![0; count];
        let mut pending = vec![(0_u32, 1_u32)];
        let mut deepest = 1;
        while let Some((index, depth)) = pending.pop() {
            deepest = deepest.max(depth);
            for side in 0..2 {
                match tree.nodes[index as usize].child(side) {
                    Child::Empty => assert_eq!((index, side), (0, 1)),
                    Child::Inner(child) => {
                        assert!(child > index);
                        let (outer, inner) = (
                            tree.nodes[index as usize].child_bounds(side),
                            tree.nodes[child as usize].bounds(),
                        );
                        assert!(outer.0.cmple(inner.0).all() && outer.1.cmpge(inner.1).all());
                        pending.push((child, depth + 1));
                    }
                    Child::Leaf { first, count } => {
                        (first..first + count).for_each(|position| covered[position as usize] += 1);
                    }
                }
            }
        }
        assert_eq!(deepest, tree.depth);
        assert!(covered.iter().all(|&times| times == 1));
        let mut order = tree.order.clone();
        order.sort_unstable();
        assert_eq!(order, (0..count as u32).collect::<Vec<_>>());
    }

    #[test]
    fn every_primitive_is_in_one_leaf() {
        for count in [1, 2, 3, 5, 100, 5000] {
            check(&build(&grid(count), BuildQuality::Default, &never).unwrap(), count);
        }
    }

    #[test]
    fn twenty_thousand_equal_boxes_give_a_shallow_tree() {
        let tree = build(&[(Vec3::ZERO, Vec3::ONE); 20_000], BuildQuality::Default, &never).unwrap();
        check(&tree, 20_000);
        assert!(tree.depth as usize <= MAX_DEPTH, "depth {}", tree.depth);
    }

    #[test]
    fn the_median_build_is_logarithmic_and_valid() {
        let tree = median(&grid(3000));
        check(&tree, 3000);
        assert!(tree.depth <= 12, "depth {}", tree.depth);
    }

    #[test]
    fn no_boxes_make_an_empty_root() {
        assert_eq!(build(&[], BuildQuality::Default, &never).unwrap().nodes, [Node::EMPTY]);
    }
}
