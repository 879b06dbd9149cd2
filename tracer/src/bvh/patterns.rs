//! Patterns of boxes that are hard for builders. Work is counted, not timed.

use glam::{Vec2, Vec3};

use super::build::{build, build_wide};
use super::cluster::Work;
use super::divide::Bounds;
use super::reinsert::improve;
use super::wide::half_area;
use super::{BuildQuality, MAX_DEPTH, MAX_WIDE_DEPTH, WIDTH, WideTree, validate_wide};
use crate::cancel::never;

/// Deterministic pseudo-random number from 0 to 1.
fn dice(index: usize, salt: u64) -> f32 {
    let mixed =
        (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ salt.wrapping_mul(0xD6E8_FEB8_6659_FD93);
    let mixed = (mixed ^ mixed >> 32).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    ((mixed ^ mixed >> 32) >> 40) as f32 / (1 << 24) as f32
}

fn anywhere(index: usize) -> Vec3 {
    Vec3::new(dice(index, 1), dice(index, 2), dice(index, 3))
}

/// The bounding box of points.
fn around(points: &[Vec3]) -> Bounds {
    points
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), &point| (lo.min(point), hi.max(point)))
}

fn cube(center: Vec3, half: f32) -> Bounds {
    (center - half, center + half)
}

/// A pattern: the box for an index, given the number of boxes.
type Pattern = fn(usize, usize) -> Bounds;

const RANDOM: (&str, Pattern) = ("random", |i, n| cube(anywhere(i), 0.5 / (n as f32).cbrt()));

const PATTERNS: [(&str, Pattern); 21] = [
    ("row", |i, _| cube(Vec3::new(i as f32, 0.0, 0.0), 0.5)),
    ("row with gaps", |i, _| cube(Vec3::new(0.0, i as f32 * 4.0, 0.0), 0.5)),
    ("row of overlapping boxes", |i, _| cube(Vec3::new(0.0, 0.0, i as f32), 20.0)),
    ("diagonal row", |i, _| cube(Vec3::splat(i as f32), 0.5)),
    ("ribbon", |i, _| {
        let corner = |i: usize| Vec3::new((i / 2) as f32, (i % 2) as f32, 0.0);
        around(&[corner(i), corner(i + 1), corner(i + 2)])
    }),
    ("fan", |i, n| {
        let rim = |i: usize| Vec2::from_angle(i as f32 / n as f32 * std::f32::consts::TAU).extend(0.0);
        around(&[Vec3::ZERO, rim(i), rim(i + 1)])
    }),
    ("grid", |i, n| {
        let side = (n as f32).sqrt() as usize;
        cube(Vec3::new((i % side) as f32, 0.0, (i / side) as f32), 0.5)
    }),
    ("cube of boxes", |i, n| {
        let side = (n as f32).cbrt() as usize;
        cube(Vec3::new((i % side) as f32, (i / side % side) as f32, (i / side / side) as f32), 0.3)
    }),
    ("row whose gaps grow", |i, n| cube(Vec3::new((i as f32 / n as f32).powi(2), 0.0, 0.0), 1e-7)),
    ("row whose gaps and boxes grow", |i, n| {
        let at = (i as f32 / n as f32 * 60.0).exp2();
        cube(Vec3::new(at, 0.0, 0.0), at * 30.0 / n as f32)
    }),
    ("row of powers", |i, n| cube(Vec3::new((i as f32 / n as f32 * 48.0).exp2(), 0.0, 0.0), 1e-3)),
    ("same box", |_, _| cube(Vec3::ONE, 1.0)),
    ("points in one place", |_, _| cube(Vec3::ONE, 0.0)),
    ("eight of each", |i, n| cube(anywhere(i / 8), 0.5 / (n as f32).cbrt())),
    ("inside each other", |i, n| cube(Vec3::ZERO, (i + 1) as f32 / n as f32)),
    ("around each other", |i, n| cube(Vec3::ZERO, (n - i) as f32 / n as f32)),
    ("spiral", |i, n| {
        let turn = Vec2::from_angle(i as f32 * 0.01) * (i as f32 / n as f32 * 20.0).exp2();
        cube(turn.extend(0.0), turn.length() * 0.01)
    }),
    ("small ones among huge ones", |i, n| {
        cube(anywhere(i), if i.is_multiple_of(50) { 0.5 } else { 0.5 / (n as f32).cbrt() })
    }),
    ("slivers along axes", |i, n| {
        let half = Vec3::splat(0.1 / (n as f32).cbrt());
        let long = [Vec3::X, Vec3::Y, Vec3::Z][i % 3] * (0.3 * dice(i, 4));
        (anywhere(i) - half - long, anywhere(i) + half + long)
    }),
    ("slivers across", |i, _| around(&[anywhere(i), anywhere(i) + anywhere(i + 7) * 0.1])),
    ("a row in a corner of a hall", |i, n| match i.is_multiple_of(10) {
        true => cube(anywhere(i) * 1e4, 20.0),
        false => cube(Vec3::new(i as f32 / n as f32, 0.0, 0.0), 0.5 / n as f32),
    }),
];

fn boxes((_, pattern): (&str, Pattern), count: usize) -> Vec<Bounds> {
    (0..count).map(|index| pattern(index, count)).collect()
}

/// Expected number of nodes that a ray visits which enters the root anywhere.
fn visits(tree: &WideTree) -> f32 {
    let root = half_area(tree.nodes[0].bounds());
    tree.nodes.iter().map(|node| half_area(node.bounds()) / root).sum()
}

/// Work of a build beyond the parts that take O(n) for all boxes.
fn work_of(boxes: &[Bounds], quality: BuildQuality) -> (Work, u64) {
    let effort = quality.effort();
    let (mut tree, work) = effort.clustering.of(boxes, &never).unwrap();
    (work, improve(&mut tree, effort.reinsertion, &never).unwrap())
}

#[test]
fn every_pattern_takes_about_the_work_of_random_boxes_places() {
    const COUNT: usize = 100_000;
    for quality in [BuildQuality::Fast, BuildQuality::Default] {
        let (random, visits) = work_of(&boxes(RANDOM, COUNT), quality);
        for pattern in PATTERNS {
            let (name, all) = (pattern.0, boxes(pattern, COUNT));
            let (work, looked_at) = work_of(&all, quality);
            assert!(work.clusters <= 2 * random.clusters, "{name}: {work:?}, random: {random:?}");
            assert!(work.rounds <= 3 * random.rounds, "{name}: {work:?}, random: {random:?}");
            assert!(looked_at <= 8 * visits, "{name}: {looked_at} nodes looked at, random: {visits}");
        }
    }
}

#[test]
fn rays_visit_few_nodes_of_rows_and_grids() {
    // A ray that enters a row at any place in any direction visits the nodes above one leaf, and few more.
    for (name, most) in
        [("row", 4.0), ("ribbon", 4.0), ("diagonal row", 1.5), ("grid", 4.5), ("cube of boxes", 13.0)]
    {
        let pattern = PATTERNS.into_iter().find(|pattern| pattern.0 == name).unwrap();
        let tree = build_wide(&boxes(pattern, 50_000), WIDTH, BuildQuality::Default, &never).unwrap();
        let met = visits(&tree);
        assert!(met <= most, "{name}: {met} nodes a ray");
    }
}

#[test]
fn trees_over_every_pattern_are_shallow_and_valid() {
    const COUNT: usize = 20_000;
    for pattern in PATTERNS {
        let (name, all) = (pattern.0, boxes(pattern, COUNT));
        let tree = build(&all, BuildQuality::Default, &never).unwrap();
        assert!(tree.depth as usize <= MAX_DEPTH, "{name}: depth {}", tree.depth);
        for leaf in [1, WIDTH] {
            let wide = build_wide(&all, leaf, BuildQuality::Default, &never).unwrap();
            assert_eq!(validate_wide(&wide.nodes, wide.blocks.len() as u32), Ok(wide.depth), "{name}");
            assert!(wide.depth as usize <= MAX_WIDE_DEPTH, "{name}: {} wide nodes deep", wide.depth);
            let mut held: Vec<u32> = wide.blocks.iter().flatten().copied().collect();
            held.sort_unstable();
            assert!(held.into_iter().eq(0..COUNT as u32), "{name}: boxes are missing");
        }
    }
}
