//! Trees of sixteen children a node, over blocks of sixteen triangles: one vector operation looks at a whole node, or
//! at a whole leaf.
//!
//! Made from a binary tree by opening, again and again, the child with the largest surface
//! (Wald, Benthin and Boulos, "Getting Rid of Packets", RT 2008), until sixteen stand side by side. A subtree with no
//! more than sixteen triangles becomes a leaf: one block.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::{Child, MAX_WIDE_DEPTH, Node, Tree};
use crate::simd::{LANES, Lanes};

/// Children of a node, and triangles of a block.
pub(crate) const WIDTH: usize = LANES;

/// Marks a child that is a block of triangles; the other bits are its index.
const LEAF: u32 = 1 << 31;

/// Up to sixteen children with their boxes. Bounds are indexed `[axis].0[child]`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct WideNode {
    /// Least corners; zero where there is no child.
    pub lo: [Lanes; 3],
    /// Greatest corners.
    pub hi: [Lanes; 3],
    /// Index of a node, or of a block with [`LEAF`] set.
    children: [u32; WIDTH],
    /// How many there are, from the first on.
    pub count: u32,
    reserved: [u32; 15],
}

const _: () = assert!(size_of::<WideNode>() == 512);

/// What hangs in a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WideChild {
    /// The node of this index.
    Inner(u32),
    /// The block of this index.
    Block(u32),
}

impl WideNode {
    pub(crate) fn child(&self, lane: usize) -> WideChild {
        let child = self.children[lane];
        if child & LEAF == 0 { WideChild::Inner(child) } else { WideChild::Block(child & !LEAF) }
    }

    /// One bit per child.
    pub(crate) fn present(&self) -> u32 {
        (1_u32 << self.count.min(WIDTH as u32)) - 1
    }

    /// The box of all children.
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

    fn push(&mut self, (lo, hi): (Vec3, Vec3), child: u32) {
        let lane = self.count as usize;
        for axis in 0..3 {
            self.lo[axis].0[lane] = lo[axis];
            self.hi[axis].0[lane] = hi[axis];
        }
        self.children[lane] = child;
        self.count += 1;
    }
}

/// A wide tree, and which primitives stand in which block.
pub(crate) struct WideTree {
    pub nodes: Vec<WideNode>,
    /// Up to sixteen primitives each.
    pub blocks: Vec<Vec<u32>>,
    pub depth: u32,
}

/// A child of the binary tree.
#[derive(Clone, Copy)]
struct Open {
    bounds: (Vec3, Vec3),
    child: Child,
    primitives: u32,
}

/// Widens a binary tree.
pub(crate) fn widen(tree: &Tree) -> WideTree {
    let sizes = subtree_sizes(&tree.nodes);
    let mut wide = WideTree { nodes: vec![WideNode::zeroed()], blocks: Vec::new(), depth: 1 };
    let mut pending = vec![(0_u32, children_of(&tree.nodes[0], &sizes), 1_u32)];
    while let Some((own, children, depth)) = pending.pop() {
        wide.depth = wide.depth.max(depth);
        for open in opened(children, &tree.nodes, &sizes) {
            let link = if open.primitives as usize <= WIDTH {
                wide.blocks.push(primitives_below(tree, open.child));
                LEAF | (wide.blocks.len() - 1) as u32
            } else {
                wide.nodes.push(WideNode::zeroed());
                (wide.nodes.len() - 1) as u32
            };
            wide.nodes[own as usize].push(open.bounds, link);
            if link & LEAF == 0
                && let Child::Inner(node) = open.child
            {
                pending.push((link, children_of(&tree.nodes[node as usize], &sizes), depth + 1));
            }
        }
    }
    wide
}

/// Opens the largest child that is no leaf of the wide tree, until there are sixteen or none is left to open.
fn opened(mut children: Vec<Open>, nodes: &[Node], sizes: &[u32]) -> Vec<Open> {
    while children.len() < WIDTH {
        let largest = (0..children.len())
            .filter(|&i| children[i].primitives as usize > WIDTH)
            .max_by(|&a, &b| half_area(children[a].bounds).total_cmp(&half_area(children[b].bounds)));
        let Some(index) = largest else { break };
        let Child::Inner(node) = children[index].child else { break };
        let mut inner = children_of(&nodes[node as usize], sizes).into_iter();
        // A binary node has two children, unless it is a root with one leaf: then there is nothing to open.
        children[index] = inner.next().unwrap_or(children[index]);
        children.extend(inner);
    }
    children
}

fn half_area((lo, hi): (Vec3, Vec3)) -> f32 {
    let size = hi - lo;
    size.x * size.y + size.y * size.z + size.z * size.x
}

fn children_of(node: &Node, sizes: &[u32]) -> Vec<Open> {
    (0..2)
        .filter_map(|side| {
            let child = node.child(side);
            let primitives = match child {
                Child::Empty => return None,
                Child::Inner(inner) => sizes[inner as usize],
                Child::Leaf { count, .. } => count,
            };
            Some(Open { bounds: node.child_bounds(side), child, primitives })
        })
        .collect()
}

/// Primitives below each node; children stand behind their parents.
fn subtree_sizes(nodes: &[Node]) -> Vec<u32> {
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

fn primitives_below(tree: &Tree, child: Child) -> Vec<u32> {
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

/// Why bytes are no tree.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("its tree is broken at node {node}: {what}")]
pub(crate) struct TreeError {
    /// Where.
    node: usize,
    /// What was found.
    what: String,
}

/// Trees come from files and peers: one pass makes sure that no walk leaves them.
///
/// Checks in O(n) that children come after their parents, that every node and block has one parent, that the depth is
/// within [`MAX_WIDE_DEPTH`], and that all bounds are finite. Returns the depth.
///
/// # Errors
/// The first node that breaks one of these.
pub(crate) fn validate_wide(nodes: &[WideNode], block_count: u32) -> Result<u32, TreeError> {
    let broken = |node: usize, what: String| Err(TreeError { node, what });
    if nodes.is_empty() {
        return broken(0, "there is no root".into());
    }
    let mut depths = vec![0_u8; nodes.len()];
    depths[0] = 1;
    let mut covered = vec![false; block_count as usize];
    let mut deepest = 1;
    for (index, node) in nodes.iter().enumerate() {
        let depth = depths[index];
        if depth == 0 {
            return broken(index, "no node names it as its child".into());
        }
        deepest = deepest.max(depth);
        if node.count == 0 || node.count as usize > WIDTH {
            return broken(index, format!("it has {} children", node.count));
        }
        if node.lo.iter().chain(&node.hi).flat_map(|lanes| lanes.0).any(|bound| !bound.is_finite()) {
            return broken(index, "a bound is not finite".into());
        }
        for lane in 0..node.count as usize {
            match node.child(lane) {
                WideChild::Inner(child) => {
                    let child = child as usize;
                    if child <= index || child >= nodes.len() || depths[child] != 0 {
                        return broken(
                            index,
                            format!("its child {child} is not one that comes after it, once"),
                        );
                    }
                    if depth as usize >= MAX_WIDE_DEPTH {
                        return broken(index, format!("it is deeper than {MAX_WIDE_DEPTH}"));
                    }
                    depths[child] = depth + 1;
                }
                WideChild::Block(block) => match covered.get_mut(block as usize) {
                    Some(seen) if !*seen => *seen = true,
                    _ => return broken(index, format!("its block {block} is not there, or has two parents")),
                },
            }
        }
    }
    if covered.contains(&false) {
        return broken(0, "a block hangs nowhere".into());
    }
    Ok(u32::from(deepest))
}

#[cfg(test)]
mod tests {
    use super::super::build_wide;
    use super::*;

    fn boxes(n: usize) -> Vec<(Vec3, Vec3)> {
        (0..n)
            .map(|i| {
                let corner = Vec3::new((i % 17) as f32, (i / 17 % 13) as f32, (i / 221) as f32);
                (corner, corner + 0.9)
            })
            .collect()
    }

    /// A node with the given children, all in the unit box.
    fn node(children: &[u32]) -> WideNode {
        let mut node = WideNode::zeroed();
        children.iter().for_each(|&child| node.push((Vec3::ZERO, Vec3::ONE), child));
        node
    }

    #[test]
    fn every_primitive_stands_in_one_block_inside_the_boxes_above() {
        for count in [1, 2, 16, 17, 300, 5000] {
            let all = boxes(count);
            let tree = build_wide(all.clone());
            assert_eq!(validate_wide(&tree.nodes, tree.blocks.len() as u32).unwrap(), tree.depth);
            let mut seen: Vec<u32> = tree.blocks.iter().flatten().copied().collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..count as u32).collect::<Vec<_>>());
            assert!(tree.blocks.iter().all(|block| !block.is_empty() && block.len() <= WIDTH));
            let (lo, hi) = tree.nodes[0].bounds();
            assert!(all.iter().all(|(a, b)| lo.cmple(*a).all() && hi.cmpge(*b).all()));
        }
    }

    #[test]
    fn two_thousand_boxes_in_one_place_stay_shallow() {
        let tree = build_wide(vec![(Vec3::ZERO, Vec3::ONE); 2_000]);
        assert!(tree.depth as usize <= MAX_WIDE_DEPTH, "depth {}", tree.depth);
    }

    #[test]
    fn what_would_lead_a_walk_astray_is_named() {
        let mut infinite = node(&[LEAF]);
        infinite.hi[1].0[0] = f32::INFINITY;
        let mut crowded = node(&[LEAF]);
        crowded.count = 17;
        let chain: Vec<WideNode> = (0..=MAX_WIDE_DEPTH as u32).map(|i| node(&[i + 1])).collect();
        let cases = [
            (vec![], 0, "no root"),
            (vec![node(&[])], 0, "0 children"),
            (vec![crowded], 1, "17 children"),
            (vec![node(&[0])], 0, "comes after"),
            (vec![node(&[7])], 0, "comes after"),
            (vec![node(&[1, 1]), node(&[LEAF])], 1, "comes after"),
            (vec![node(&[LEAF, LEAF])], 1, "two parents"),
            (vec![node(&[LEAF | 5])], 1, "not there"),
            (vec![node(&[LEAF])], 2, "hangs nowhere"),
            (vec![node(&[LEAF]), node(&[LEAF | 1])], 2, "no node names it"),
            (vec![infinite], 1, "not finite"),
            (chain, 0, "deeper than"),
        ];
        for (nodes, blocks, expected) in cases {
            let error = validate_wide(&nodes, blocks).unwrap_err().to_string();
            assert!(error.contains(expected), "{error} does not say `{expected}`");
        }
    }
}
