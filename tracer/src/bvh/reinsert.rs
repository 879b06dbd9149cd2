//! Nodes that move to a better place in their tree: parallel reinsertion (Meister and Bittner 2017), with bounded work.
//!
//! In a pass the largest nodes look for the place where the sum of areas is least, all at once; then those that gain most
//! move, unless a move of this pass has changed what is around them. A search is a branch and bound over the whole tree:
//! where boxes are inside each other nothing bounds it. Searches therefore share a number of nodes to look at: one ends
//! with the best place so far, and passes end, when there are no more.

use obvhs::bvh2::reinsertion::reinsert_node;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use rayon::prelude::*;

use super::MAX_DEPTH;
use crate::cancel::{Cancelled, IsCancelled, go_on};

/// Passes of a series; the second tries a third as many nodes as the first, the third a fifth, and so on.
const PASSES: u32 = 16;

/// Nodes that a search may look at, on average: several times as many as it needs among the triangles of a surface.
const MEAN_VISITS: u64 = 96;

/// Nodes do not move deeper than this: boxes inside each other would become a list.
const DEEPEST: usize = MAX_DEPTH - 8;

/// Nodes that a single search may look at.
const MOST_VISITS: u64 = 4096;

/// A move that was found.
#[derive(Clone, Copy, Default)]
struct Move {
    from: u32,
    to: u32,
    /// By how much the sum of areas becomes less.
    gain: f32,
    /// Nodes that the search looked at.
    visits: u32,
}

/// Improves a tree. For each of `shares` comes a series of passes, whose first tries that share of its nodes. Returns how
/// many nodes were looked at.
///
/// # Errors
/// [`Cancelled`]: the question is asked before each pass; the tree is of no use then.
pub(super) fn improve(
    tree: &mut Bvh2,
    shares: &[f32],
    cancelled: &IsCancelled<'_>,
) -> Result<u64, Cancelled> {
    let mut visits = 0;
    if tree.nodes[0].is_leaf() {
        return Ok(visits);
    }
    tree.init_parents_if_uninit();
    let count = tree.nodes.len();
    let passes = shares.iter().flat_map(|&share| (0..PASSES).map(move |pass| share / (2 * pass + 1) as f32));
    let passes: Vec<usize> =
        passes.map(|share| ((count as f32 * share) as usize).clamp(1, count - 1)).collect();
    let most = MEAN_VISITS * passes.iter().sum::<usize>() as u64;
    let mut touched = vec![0_u32; count];
    for (pass, wanted) in (1..).zip(passes) {
        go_on(cancelled)?;
        let limit = most.saturating_sub(visits) / wanted as u64;
        if limit == 0 {
            break;
        }
        let moves = find_moves(tree, wanted, limit.min(MOST_VISITS) as u32);
        visits += moves.iter().map(|found| u64::from(found.visits)).sum::<u64>();
        carry_out(tree, moves, &mut touched, pass);
    }
    Ok(visits)
}

/// What the largest nodes gain by, the most first. Each search looks at no more nodes than the limit.
fn find_moves(tree: &Bvh2, wanted: usize, limit: u32) -> Vec<Move> {
    // Those near the root are in front, as the clusters that merged last: the largest are among the first ones.
    let first = (2 * wanted + 2).min(tree.nodes.len());
    let key = |index: u32| (area_bits(&tree.nodes[index as usize]), index);
    let mut largest: Vec<u32> = (1..first as u32).collect();
    largest.par_sort_unstable_by_key(|&index| key(index));
    largest.truncate(wanted);
    let search = |stack: &mut Vec<(f32, u32)>, &node: &u32| search(tree, node, limit, stack);
    let mut moves: Vec<Move> = largest.par_iter().map_init(Vec::new, search).collect();
    moves.par_sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.from.cmp(&b.from)));
    moves
}

/// Sorts the largest area first.
fn area_bits(node: &Bvh2Node) -> u32 {
    !node.aabb().half_area().to_bits()
}

/// Carries moves out, but for those whose surroundings another one has changed: `touched` tells in which pass.
fn carry_out(tree: &mut Bvh2, moves: Vec<Move>, touched: &mut [u32], pass: u32) {
    for Move { from, to, .. } in moves.into_iter().take_while(|found| found.gain > 0.0) {
        let (from, to) = (from as usize, to as usize);
        let around =
            [to, from, sibling(from as u32) as usize, tree.parents[to] as usize, tree.parents[from] as usize];
        if around.iter().all(|&node| touched[node] != pass) && is_shallow(tree, to as u32) {
            around.iter().for_each(|&node| touched[node] = pass);
            reinsert_node(tree, from, to);
        }
    }
}

/// Whether a node is near enough to the root for another one to move there.
fn is_shallow(tree: &Bvh2, mut node: u32) -> bool {
    (0..DEEPEST).any(|_| {
        node = tree.parents[node as usize];
        node == 0
    })
}

fn sibling(node: u32) -> u32 {
    Bvh2Node::get_sibling_id32(node)
}

/// Looks for the best place for a node: which other node should be its sibling.
fn search(tree: &Bvh2, from: u32, limit: u32, stack: &mut Vec<(f32, u32)>) -> Move {
    let node = tree.nodes[from as usize].aabb();
    let (own, parent) = (node.half_area(), tree.parents[from as usize]);
    let mut best = Move { from, ..Move::default() };
    // Without the node and its parent, the sibling is in the parent's place; the ancestors' boxes become smaller.
    let mut gain = tree.nodes[parent as usize].aabb().half_area();
    let (mut beside, mut above) = (sibling(from), parent);
    let mut rest = *tree.nodes[beside as usize].aabb();
    'ancestors: loop {
        stack.clear();
        stack.push((gain, beside));
        while let Some((gain, to)) = stack.pop() {
            if gain - own <= best.gain {
                continue;
            }
            if best.visits >= limit {
                break 'ancestors;
            }
            best.visits += 1;
            let place = &tree.nodes[to as usize];
            let here = gain - place.aabb().union(node).half_area();
            if here > best.gain {
                (best.to, best.gain) = (to, here);
            }
            if !place.is_leaf() {
                let below = here + place.aabb().half_area();
                stack.push((below, place.first_index));
                stack.push((below, place.first_index + 1));
            }
        }
        if above != parent {
            rest = rest.union(tree.nodes[beside as usize].aabb());
            gain += tree.nodes[above as usize].aabb().half_area() - rest.half_area();
        }
        if above == 0 {
            break;
        }
        best.visits += 1;
        if best.visits >= limit {
            break;
        }
        beside = sibling(above);
        above = tree.parents[above as usize];
    }
    if best.to == sibling(from) || best.to == parent {
        return Move { visits: best.visits, ..Move::default() };
    }
    best
}
