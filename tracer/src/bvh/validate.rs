//! Trees come from files and peers: one pass makes sure that no walk leaves them.

use super::{Child, MAX_DEPTH, Node};

/// Why bytes are no tree.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("its tree is broken at node {node}: {what}")]
pub struct TreeError {
    /// Where.
    pub node: usize,
    /// What was found.
    pub what: String,
}

/// Checks in O(n) that children come after their parents (so there is no cycle), that every node but the root has
/// one parent, that leaves cover `primitive_count` primitives once each and in order of the walk, that the depth is
/// within [`MAX_DEPTH`], and that no bound is NaN. Returns the depth.
///
/// # Errors
/// The first node that breaks one of these.
pub fn validate(nodes: &[Node], primitive_count: u32) -> Result<u32, TreeError> {
    let broken = |node: usize, what: String| Err(TreeError { node, what });
    if nodes.is_empty() {
        return broken(0, "there is no root".into());
    }
    let mut depths = vec![0_u8; nodes.len()];
    depths[0] = 1;
    let mut covered = vec![false; primitive_count as usize];
    let mut deepest = 1;
    for (index, node) in nodes.iter().enumerate() {
        let depth = depths[index];
        if depth == 0 {
            return broken(index, "no node names it as its child".into());
        }
        deepest = deepest.max(depth);
        if node.lo.iter().chain(&node.hi).flatten().any(|bound| bound.is_nan()) {
            return broken(index, "a bound is not a number".into());
        }
        for side in 0..2 {
            match node.child(side) {
                Child::Empty => {
                    let (lo, hi) = node.child_bounds(side);
                    if index != 0 || lo.x <= hi.x {
                        return broken(index, "an empty child where none may be".into());
                    }
                }
                Child::Inner(child) => {
                    let child = child as usize;
                    if child <= index || child >= nodes.len() {
                        return broken(index, format!("its child {child} does not come after it"));
                    }
                    if depths[child] != 0 {
                        return broken(index, format!("its child {child} has another parent"));
                    }
                    if depth as usize >= MAX_DEPTH {
                        return broken(index, format!("it is deeper than {MAX_DEPTH}"));
                    }
                    depths[child] = depth + 1;
                }
                Child::Leaf { first, count } => {
                    let end = first.checked_add(count).filter(|&end| end <= primitive_count);
                    let Some(end) = end else {
                        return broken(index, format!("a leaf of {count} from {first} on leaves the list"));
                    };
                    let leaf = &mut covered[first as usize..end as usize];
                    if leaf.contains(&true) {
                        return broken(index, "two leaves share a primitive".into());
                    }
                    leaf.fill(true);
                }
            }
        }
    }
    if covered.contains(&false) {
        return broken(0, "a primitive is in no leaf".into());
    }
    Ok(u32::from(deepest))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn leaf(first: u32, count: u32) -> Child {
        Child::Leaf { first, count }
    }

    fn node(left: Child, right: Child) -> Node {
        let mut node = Node::EMPTY;
        for (side, child) in [left, right].into_iter().enumerate() {
            if child != Child::Empty {
                node.set(side, (Vec3::ZERO, Vec3::ONE), child);
            }
        }
        node
    }

    #[test]
    fn a_sound_tree_passes_and_tells_its_depth() {
        let nodes = [node(Child::Inner(1), leaf(3, 1)), node(leaf(0, 2), leaf(2, 1))];
        assert_eq!(validate(&nodes, 4), Ok(2));
    }

    #[test]
    fn what_would_lead_a_walk_astray_is_named() {
        let cases = [
            (vec![], 0, "no root"),
            (vec![node(Child::Inner(0xffff), leaf(0, 1))], 1, "does not come after"),
            (vec![node(leaf(0, 2), leaf(1, 1))], 2, "share"),
            (vec![node(leaf(0, 1), leaf(1, u32::MAX))], 2, "leaves the list"),
            (vec![node(leaf(0, 1), Child::Empty)], 2, "in no leaf"),
            (vec![node(leaf(0, 1), leaf(1, 1)), Node::EMPTY], 2, "no node names it"),
            (vec![node(Child::Inner(1), Child::Inner(1)), node(leaf(0, 1), leaf(1, 1))], 2, "another parent"),
        ];
        for (nodes, count, expected) in cases {
            let error = validate(&nodes, count).unwrap_err().to_string();
            assert!(error.contains(expected), "{error} does not say `{expected}`");
        }
    }

    #[test]
    fn a_list_of_nodes_is_too_deep() {
        let count = MAX_DEPTH as u32 + 1;
        let nodes: Vec<Node> = (0..count)
            .map(|i| {
                let below = if i + 1 < count { Child::Inner(i + 1) } else { leaf(i + 1, 1) };
                node(leaf(i, 1), below)
            })
            .collect();
        assert!(validate(&nodes, count + 1).unwrap_err().to_string().contains("deeper than 64"));
    }
}
