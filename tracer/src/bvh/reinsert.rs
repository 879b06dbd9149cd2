//! Improvement of a tree by parallel reinsertion of nodes (Meister and Bittner 2017), with bounded work.
//!
//! In a pass the largest nodes search in parallel for the position with the least sum of areas. Then the nodes with
//! the largest gains move, unless an earlier move of the pass has changed their surroundings. A search is a branch
//! and bound over the whole tree, which nested boxes do not bound. Therefore searches share a budget of visited
//! nodes: a search ends with the best position so far, and passes end, when the budget is used up.

use obvhs::bvh2::reinsertion::reinsert_node;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use rayon::prelude::*;

use super::MAX_DEPTH;
use crate::cancel::{Cancelled, IsCancelled, go_on};

/// Passes of a series. The second tries a third as many nodes as the first, the third a fifth, and so on.
const PASSES: u32 = 16;

/// Visited nodes per search on average: several times the number that searches among the triangles of a surface need.
const MEAN_VISITS: u64 = 96;

/// Largest depth to which nodes move: nested boxes would become a list.
const DEEPEST: usize = MAX_DEPTH - 8;

/// Visited nodes of a single search at most.
const MOST_VISITS: u64 = 4096;

/// A move found by a search.
#[derive(Clone, Copy, Default)]
struct Move {
    from: u32,
    to: u32,
    /// Reduction of the sum of areas.
    gain: f32,
    /// Nodes that the search visited.
    visits: u32,
}

/// Improves a tree by a series of passes for each of `shares`, whose first pass tries that share of the nodes.
/// Returns the number of visited nodes.
///
/// # Errors
/// [`Cancelled`]: `cancelled` is polled before each pass; the tree is invalid then.
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

/// Moves of the largest nodes, those with the largest gain first. Each search visits at most `limit` nodes.
fn find_moves(tree: &Bvh2, wanted: usize, limit: u32) -> Vec<Move> {
    // Nodes near the root are in front, because these clusters merged last: the largest ones are among them.
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

/// A key that sorts the largest area first.
fn area_bits(node: &Bvh2Node) -> u32 {
    !node.aabb().half_area().to_bits()
}

/// Performs moves, except those whose surroundings an earlier one of this pass has changed, which `touched` records.
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

/// Whether a node is near enough to the root to receive another node below it.
fn is_shallow(tree: &Bvh2, mut node: u32) -> bool {
    (0..DEEPEST).any(|_| {
        node = tree.parents[node as usize];
        node == 0
    })
}

fn sibling(node: u32) -> u32 {
    Bvh2Node::get_sibling_id32(node)
}

/// Searches the best new sibling for a node.
fn search(tree: &Bvh2, from: u32, limit: u32, stack: &mut Vec<(f32, u32)>) -> Move {
    let node = tree.nodes[from as usize].aabb();
    let (own, parent) = (node.half_area(), tree.parents[from as usize]);
    let mut best = Move { from, ..Move::default() };
    // Without the node, its sibling takes the place of the parent, and the boxes of the ancestors shrink.
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
