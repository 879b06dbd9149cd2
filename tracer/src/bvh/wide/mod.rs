//! Trees of sixteen children per node, over blocks of sixteen triangles: one vector operation tests a whole node or a
//! whole leaf.
//!
//! They are collapsed from binary trees (`collapse.rs`). A subtree of at most sixteen triangles becomes a leaf: one
//! block.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::collapse::Collapse;
use super::{Child, MAX_WIDE_DEPTH, Node, Tree};
use crate::simd::{LANES, Lanes, Simd, SimdBase, mask32x16, u32x16};

/// Children of a node, and triangles of a block.
pub(crate) const WIDTH: usize = LANES;

/// Marks a child that is a block of triangles; the other bits are its index.
const LEAF: u32 = 1 << 31;

/// Up to sixteen children with their boxes. Bounds are indexed `[axis].0[child]`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct WideNode {
    /// Lower corners; zero in lanes without a child.
    pub lo: [Lanes; 3],
    /// Upper corners.
    pub hi: [Lanes; 3],
    /// Index of a node, or of a block with [`LEAF`] set; zero in lanes without a child.
    children: [u32; WIDTH],
    /// Number of children, in the first lanes.
    pub count: u32,
    reserved: [u32; 15],
}

const _: () = assert!(size_of::<WideNode>() == 512);

/// A child of a wide node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WideChild {
    /// The node with this index.
    Inner(u32),
    /// The block with this index.
    Block(u32),
}

impl WideChild {
    /// The child of a link: the index of a node, or of a block with [`LEAF`] set.
    #[inline(always)]
    pub(crate) fn of(link: u32) -> Self {
        if link & LEAF == 0 { WideChild::Inner(link) } else { WideChild::Block(link & !LEAF) }
    }
}

impl WideNode {
    pub(crate) fn child(&self, lane: usize) -> WideChild {
        WideChild::of(self.children[lane])
    }

    /// The link of a lane: see [`WideChild::of`].
    #[inline(always)]
    pub(crate) fn link(&self, lane: usize) -> u32 {
        self.children[lane]
    }

    /// Mask of the lanes with a child. It reads the cache line of the links, which the traversal needs next, in place
    /// of the one with the count.
    #[inline(always)]
    pub(crate) fn present_lanes<S: Simd>(&self, simd: S) -> mask32x16<S> {
        // The root is no child, and lanes without a child hold zero.
        u32x16::load_array_ref(simd, &self.children).simd_gt(u32x16::splat(simd, 0))
    }

    /// Lower corners of the boxes by axis, then upper ones; the last two entries are links and the count, not
    /// numbers.
    #[inline(always)]
    pub(crate) fn sides(&self) -> &[Lanes; 8] {
        bytemuck::cast_ref(self)
    }

    /// One bit per child.
    pub(crate) fn present(&self) -> u32 {
        (1_u32 << self.count.min(WIDTH as u32)) - 1
    }

    /// The box around all children.
    pub(crate) fn bounds(&self) -> (Vec3, Vec3) {
        (0..self.count.min(WIDTH as u32) as usize).fold(
            (Vec3::INFINITY, Vec3::NEG_INFINITY),
            |(lo, hi), lane| {
                let corner =
                    |bounds: &[Lanes; 3]| Vec3::from_array(std::array::from_fn(|axis| bounds[axis].0[lane]));
                (lo.min(corner(&self.lo)), hi.max(corner(&self.hi)))
            },
        )
    }

    fn push(&mut self, bounds: (Vec3, Vec3), child: u32) {
        let lane = self.count as usize;
        self.set_bounds(lane, bounds);
        self.children[lane] = child;
        self.count += 1;
    }

    fn set_bounds(&mut self, lane: usize, (lo, hi): (Vec3, Vec3)) {
        for axis in 0..3 {
            self.lo[axis].0[lane] = lo[axis];
            self.hi[axis].0[lane] = hi[axis];
        }
    }
}

/// A wide tree, and the primitives of each block.
#[derive(Clone, Debug)]
pub(crate) struct WideTree {
    pub nodes: Vec<WideNode>,
    /// Up to sixteen primitives each.
    pub blocks: Vec<Vec<u32>>,
    pub depth: u32,
}

impl WideTree {
    /// The nodes with other boxes, from those of the primitives.
    pub(crate) fn refitted(&self, bounds_of: impl Fn(u32) -> (Vec3, Vec3)) -> Vec<WideNode> {
        let mut nodes = self.nodes.clone();
        // Children are stored behind their parents.
        for index in (0..nodes.len()).rev() {
            for lane in 0..nodes[index].count as usize {
                let bounds = match nodes[index].child(lane) {
                    WideChild::Inner(child) => nodes[child as usize].bounds(),
                    WideChild::Block(block) => self.blocks[block as usize].iter().fold(
                        (Vec3::INFINITY, Vec3::NEG_INFINITY),
                        |(lo, hi), &primitive| {
                            let (a, b) = bounds_of(primitive);
                            (lo.min(a), hi.max(b))
                        },
                    ),
                };
                nodes[index].set_bounds(lane, bounds);
            }
        }
        nodes
    }
}

/// Widens a binary tree so that a ray visits few nodes. Subtrees of at most `leaf` primitives become leaves, and so
/// do leaves with more.
pub(crate) fn widen(tree: &Tree, leaf: usize) -> WideTree {
    let sizes = subtree_sizes(&tree.nodes);
    let collapse = Collapse::new(tree, |node| sizes[node as usize] as usize <= leaf);
    widen_by(tree, leaf, &sizes, |node, emit| collapse.children(node, emit))
}

/// Widens a binary tree so that it is shallow: four of its levels become one.
pub(crate) fn widen_evenly(tree: &Tree, leaf: usize) -> WideTree {
    let sizes = subtree_sizes(&tree.nodes);
    let is_inner = |node: u32| sizes[node as usize] as usize > leaf;
    widen_by(tree, leaf, &sizes, |node, emit| grandchildren(tree, node, WIDTH.ilog2(), &is_inner, emit))
}

/// Calls `emit(node, side)` for the nodes `levels` levels below a node, or above where a path is shorter.
fn grandchildren(
    tree: &Tree,
    node: u32,
    levels: u32,
    is_inner: &impl Fn(u32) -> bool,
    emit: &mut dyn FnMut(u32, usize),
) {
    for side in 0..2 {
        match tree.nodes[node as usize].child(side) {
            Child::Empty => {}
            Child::Inner(inner) if levels > 1 && is_inner(inner) => {
                grandchildren(tree, inner, levels - 1, is_inner, emit);
            }
            _ => emit(node, side),
        }
    }
}

/// Widens a binary tree. `children` calls its second argument with the parent and the side of each child of a wide
/// node.
fn widen_by(
    tree: &Tree,
    leaf: usize,
    sizes: &[u32],
    children: impl Fn(u32, &mut dyn FnMut(u32, usize)),
) -> WideTree {
    let mut wide = WideTree { nodes: vec![WideNode::zeroed()], blocks: Vec::new(), depth: 1 };
    let mut pending = vec![(0_u32, 0_u32, 1_u32)];
    while let Some((own, source, depth)) = pending.pop() {
        wide.depth = wide.depth.max(depth);
        children(source, &mut |parent, side| {
            let node = &tree.nodes[parent as usize];
            let child = node.child(side);
            let link = match child {
                Child::Inner(inner) if sizes[inner as usize] as usize > leaf => {
                    wide.nodes.push(WideNode::zeroed());
                    let link = (wide.nodes.len() - 1) as u32;
                    pending.push((link, inner, depth + 1));
                    link
                }
                _ => {
                    wide.blocks.push(primitives_below(tree, child));
                    LEAF | (wide.blocks.len() - 1) as u32
                }
            };
            wide.nodes[own as usize].push(node.child_bounds(side), link);
        });
    }
    wide
}

pub(super) fn half_area((lo, hi): (Vec3, Vec3)) -> f32 {
    let size = hi - lo;
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// Number of primitives below each node; children are stored behind their parents.
pub(super) fn subtree_sizes(nodes: &[Node]) -> Vec<u32> {
    let mut sizes = vec![0; nodes.len()];
    for (index, node) in nodes.iter().enumerate().rev() {
        sizes[index] = (0..2)
            .map(|side| match node.child(side) {
                Child::Empty => 0,
                Child::Inner(inner) => sizes[inner as usize],
                Child::Leaf { count, .. } => count,
            })
            .sum();
    }
    sizes
}

pub(super) fn primitives_below(tree: &Tree, child: Child) -> Vec<u32> {
    let mut found = Vec::with_capacity(WIDTH);
    let mut pending = vec![child];
    while let Some(child) = pending.pop() {
        match child {
            Child::Empty => {}
            Child::Inner(node) => {
                let node = &tree.nodes[node as usize];
                pending.extend([node.child(1), node.child(0)]);
            }
            Child::Leaf { first, count } => {
                found.extend_from_slice(&tree.order[first as usize..(first + count) as usize]);
            }
        }
    }
    found
}

/// Reason why nodes are no valid tree.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("its tree is broken at node {node}: {what}")]
pub(crate) struct TreeError {
    /// Index of the node.
    node: usize,
    /// The fault.
    what: String,
}

/// Checks a tree from a file or a peer, so that no traversal leaves it.
///
/// Checks in O(n) that children follow their parents, that every node and block has one parent, that the depth is
/// within [`MAX_WIDE_DEPTH`], and that all bounds are finite. Returns the depth.
///
/// # Errors
/// The first node that violates one of these.
pub(crate) fn validate_wide(nodes: &[WideNode], block_count: u32) -> Result<u32, TreeError> {
    let broken = |node: usize, what: String| Err(TreeError { node, what });
    if nodes.is_empty() {
        return broken(0, "it has no root".into());
    }
    let mut depths = vec![0_u8; nodes.len()];
    depths[0] = 1;
    let mut covered = vec![false; block_count as usize];
    let mut deepest = 1;
    for (index, node) in nodes.iter().enumerate() {
        let depth = depths[index];
        if depth == 0 {
            return broken(index, "it is no node's child".into());
        }
        deepest = deepest.max(depth);
        if node.count == 0 || node.count as usize > WIDTH {
            return broken(index, format!("it has {} children", node.count));
        }
        if node.lo.iter().chain(&node.hi).flat_map(|lanes| lanes.0).any(|bound| !bound.is_finite()) {
            return broken(index, "a bound is not finite".into());
        }
        if node.children[node.count as usize..].iter().any(|&child| child != 0) {
            return broken(index, "a lane without a child names one".into());
        }
        for lane in 0..node.count as usize {
            match node.child(lane) {
                WideChild::Inner(child) => {
                    let child = child as usize;
                    if child <= index || child >= nodes.len() || depths[child] != 0 {
                        return broken(
                            index,
                            format!("its child {child} is not a later node with one parent"),
                        );
                    }
                    if depth as usize >= MAX_WIDE_DEPTH {
                        return broken(index, format!("it is deeper than {MAX_WIDE_DEPTH}"));
                    }
                    depths[child] = depth + 1;
                }
                WideChild::Block(block) => match covered.get_mut(block as usize) {
                    Some(seen) if !*seen => *seen = true,
                    _ => return broken(index, format!("its block {block} is missing, or has two parents")),
                },
            }
        }
    }
    if covered.contains(&false) {
        return broken(0, "a block has no parent".into());
    }
    Ok(u32::from(deepest))
}

#[cfg(test)]
mod tests;
