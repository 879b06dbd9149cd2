use super::super::{BuildQuality, build_wide};
use super::*;
use crate::cancel::never;

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
fn every_primitive_is_in_one_block_inside_the_boxes_above() {
    for count in [1, 2, 16, 17, 300, 5000] {
        let all = boxes(count);
        let tree = build_wide(&all, WIDTH, BuildQuality::Default, &never).unwrap();
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
fn nodes_are_well_filled() {
    let tree = build_wide(&boxes(20_000), WIDTH, BuildQuality::Default, &never).unwrap();
    let children: u32 = tree.nodes.iter().map(|node| node.count).sum();
    let mean = f64::from(children) / tree.nodes.len() as f64;
    assert!(mean > 10.0, "{mean} children a node");
}

#[test]
fn two_thousand_equal_boxes_give_a_shallow_tree() {
    let tree = build_wide(&[(Vec3::ZERO, Vec3::ONE); 2_000], WIDTH, BuildQuality::Default, &never).unwrap();
    assert!(tree.depth as usize <= MAX_WIDE_DEPTH, "depth {}", tree.depth);
}

#[test]
fn faults_of_trees_are_named() {
    let mut infinite = node(&[LEAF]);
    infinite.hi[1].0[0] = f32::INFINITY;
    let mut crowded = node(&[LEAF]);
    crowded.count = 17;
    let mut hidden = node(&[LEAF]);
    hidden.children[1] = LEAF;
    let chain: Vec<WideNode> = (0..=MAX_WIDE_DEPTH as u32).map(|i| node(&[i + 1])).collect();
    let cases = [
        (vec![], 0, "no root"),
        (vec![node(&[])], 0, "0 children"),
        (vec![crowded], 1, "17 children"),
        (vec![node(&[0])], 0, "a later node"),
        (vec![node(&[7])], 0, "a later node"),
        (vec![node(&[1, 1]), node(&[LEAF])], 1, "a later node"),
        (vec![node(&[LEAF, LEAF])], 1, "two parents"),
        (vec![node(&[LEAF | 5])], 1, "missing"),
        (vec![node(&[LEAF])], 2, "has no parent"),
        (vec![node(&[LEAF]), node(&[LEAF | 1])], 2, "no node's child"),
        (vec![infinite], 1, "not finite"),
        (vec![hidden], 1, "without a child"),
        (chain, 0, "deeper than"),
    ];
    for (nodes, blocks, expected) in cases {
        let error = validate_wide(&nodes, blocks).unwrap_err().to_string();
        assert!(error.contains(expected), "{error} does not say `{expected}`");
    }
}
