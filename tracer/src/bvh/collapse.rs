//! Choice of the binary nodes that become children of wide nodes, such that a ray visits few wide nodes.
//!
//! Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017,
//! section 3: the expected number of visited nodes is the sum of their surface areas, in shares of the root's.
//! Dynamic programming from the leaves up finds the least sum for a subtree of at most i children from the sums of
//! its halves.

use super::wide::{WIDTH, half_area};
use super::{Child, Tree};

/// Constant cost per node, in shares of the root's area: it keeps the number of nodes small where areas vanish.
const PER_NODE: f32 = 1e-6;

/// Optimum of one subtree.
#[derive(Clone, Copy)]
struct Best {
    /// Least cost with at most i + 1 children.
    cost: [f32; WIDTH],
    /// Number of children from the left half; 0 where one child fewer costs no more.
    left: [u8; WIDTH],
    /// The same for the children of the subtree's root, if it becomes a wide node.
    own: u8,
}

/// The cheapest cuts of a binary tree.
pub(super) struct Collapse<'a> {
    tree: &'a Tree,
    /// Position in `best` of each node of the tree; `u32::MAX` for nodes that are part of a leaf.
    place: Vec<u32>,
    best: Vec<Best>,
}

impl<'a> Collapse<'a> {
    /// Computes the cuts. `is_leaf` selects the nodes that become leaves, with everything below them.
    pub(super) fn new(tree: &'a Tree, is_leaf: impl Fn(u32) -> bool) -> Self {
        let mut place = vec![u32::MAX; tree.nodes.len()];
        let mut count = 0;
        for (index, place) in (0_u32..).zip(&mut place) {
            if !is_leaf(index) {
                *place = count;
                count += 1;
            }
        }
        let nothing = Best { cost: [0.0; WIDTH], left: [0; WIDTH], own: 0 };
        let mut collapse = Self { tree, place, best: vec![nothing; count as usize] };
        let per_node = (half_area(tree.nodes[0].bounds()) * PER_NODE).max(f32::MIN_POSITIVE);
        // Children are stored behind their parents.
        for index in (0..tree.nodes.len()).rev() {
            if collapse.place[index] != u32::MAX {
                let best = collapse.best_of(index, per_node);
                let place = collapse.place[index] as usize;
                collapse.best[place] = best;
            }
        }
        collapse
    }

    fn best_of(&self, index: usize, per_node: f32) -> Best {
        let node = &self.tree.nodes[index];
        let [left, right] = [0, 1].map(|side| self.costs(node.child(side)));
        let mut best = Best { cost: [0.0; WIDTH], left: [0; WIDTH], own: 1 };
        let mut split = [f32::INFINITY; WIDTH];
        for i in 1..WIDTH {
            for k in 0..i {
                let cost = left[k] + right[i - 1 - k];
                if cost < split[i] {
                    (split[i], best.left[i]) = (cost, k as u8 + 1);
                }
            }
        }
        best.own = best.left[WIDTH - 1];
        best.cost[0] = split[WIDTH - 1] + half_area(node.bounds()) + per_node;
        for i in 1..WIDTH {
            best.cost[i] = split[i];
            if best.cost[i - 1] <= split[i] {
                (best.cost[i], best.left[i]) = (best.cost[i - 1], 0);
            }
        }
        best
    }

    /// Costs of a child. Leaves are the same for all cuts, so they cost nothing.
    fn costs(&self, child: Child) -> [f32; WIDTH] {
        self.of(child).map_or([0.0; WIDTH], |best| best.cost)
    }

    fn of(&self, child: Child) -> Option<&Best> {
        let Child::Inner(index) = child else { return None };
        self.best.get(self.place[index as usize] as usize)
    }

    /// Calls `emit(node, side)` for each of the best children of an inner node; each emitted side becomes a child.
    pub(super) fn children(&self, node: u32, emit: &mut dyn FnMut(u32, usize)) {
        let left = self.of(Child::Inner(node)).map_or(1, |best| usize::from(best.own));
        self.cut(node, 0, left, emit);
        self.cut(node, 1, WIDTH - left, emit);
    }

    /// Emits one side as at most `count` children. The recursion depth is at most the number of children.
    fn cut(&self, node: u32, side: usize, mut count: usize, emit: &mut dyn FnMut(u32, usize)) {
        let child = self.tree.nodes[node as usize].child(side);
        if let (Some(best), Child::Inner(inner)) = (self.of(child), child) {
            while count > 1 && best.left[count - 1] == 0 {
                count -= 1;
            }
            if count > 1 {
                let left = usize::from(best.left[count - 1]);
                self.cut(inner, 0, left, emit);
                self.cut(inner, 1, count - left, emit);
                return;
            }
        }
        if child != Child::Empty {
            emit(node, side);
        }
    }
}
