use std::f64::consts::TAU;
use std::time::Instant;

use super::*;

fn flat(corners: &[(f64, f64)]) -> Vec<DVec3> {
    corners.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect()
}

fn cut_up(points: &[DVec3]) -> Vec<[u32; 3]> {
    let mut triangles = Vec::new();
    cut(points, &mut triangles);
    triangles
}

/// Half of the sum of the cross products: the area as a vector.
fn area_of(points: &[DVec3]) -> DVec3 {
    let origin = points[0];
    let edges = points.iter().zip(points.iter().cycle().skip(1));
    edges.map(|(a, b)| (*a - origin).cross(*b - origin)).sum::<DVec3>() / 2.0
}

fn areas(points: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    triangles.iter().map(|triangle| area_of(&triangle.map(|corner| points[corner as usize]))).collect()
}

/// Checks that triangles have the polygon's orientation and areas that sum up to its area: so none is outside, and no
/// two overlap.
fn assert_fills(points: &[DVec3], name: &str) {
    let triangles = cut_up(points);
    let (area, areas) = (area_of(points), areas(points, &triangles));
    let sum: f64 = areas.iter().map(|triangle| triangle.length()).sum();
    assert!((sum - area.length()).abs() <= 1e-9 * area.length(), "{name}: {sum} of {}", area.length());
    assert!(areas.iter().all(|triangle| triangle.dot(area) > 0.0), "{name}: {triangles:?}");
}

/// The polygon in another plane, with another first corner.
fn assert_fills_everywhere(corners: &[(f64, f64)], name: &str) {
    let planes = [
        [DVec3::X, DVec3::Y],
        [DVec3::Y, DVec3::X],
        [DVec3::Z, DVec3::X],
        [DVec3::new(1.0, 2.0, -3.0), DVec3::new(5.0, -1.0, 1.0)],
        [DVec3::new(1e-9, 3e-9, 0.0), DVec3::new(0.0, 1e-9, 2e-9)],
    ];
    for [x, y] in planes {
        for offset in [DVec3::ZERO, x * 1000.0 + y * 77.0] {
            for first in 0..corners.len().min(12) {
                let turned = corners.iter().cycle().skip(first).take(corners.len());
                let points: Vec<DVec3> = turned.map(|&(u, v)| offset + x * u + y * v).collect();
                assert_fills(&points, &format!("{name} from {first} in {x} {y} at {offset}"));
            }
        }
    }
}

const U: [(f64, f64); 8] = [(0., 0.), (3., 0.), (3., 3.), (2., 3.), (2., 1.), (1., 1.), (1., 3.), (0., 3.)];
const DART: [(f64, f64); 4] = [(2., -1.), (0., 2.), (-2., -1.), (0., 0.4)];
/// A wall, a bridge to its window, the window with inverted winding, and the bridge back.
const WINDOW: [(f64, f64); 10] =
    [(0., 0.), (4., 0.), (4., 3.), (0., 3.), (0., 0.), (1., 1.), (1., 2.), (3., 2.), (3., 1.), (1., 1.)];
/// Two windows with bridges from one corner.
const TWO_WINDOWS: [(f64, f64); 16] = [
    (0., 0.),
    (9., 0.),
    (9., 4.),
    (0., 4.),
    (0., 0.),
    (1., 1.),
    (1., 2.),
    (3., 2.),
    (3., 1.),
    (1., 1.),
    (0., 0.),
    (6., 1.),
    (6., 2.),
    (8., 2.),
    (8., 1.),
    (6., 1.),
];
/// Corners in the middle of edges, one of them twice.
const WITH_CORNERS_IN_LINE: [(f64, f64); 9] =
    [(0., 0.), (1., 0.), (1., 0.), (2., 0.), (2., 1.), (2., 2.), (1., 2.), (0., 2.), (0., 1.)];

#[test]
fn concave_polygons_are_filled_and_nothing_else() {
    for (corners, name) in [
        (&U[..], "U"),
        (&DART, "dart"),
        (&WINDOW, "window"),
        (&TWO_WINDOWS, "two windows"),
        (&WITH_CORNERS_IN_LINE, "corners in line"),
    ] {
        assert_fills_everywhere(corners, name);
    }
    assert_eq!(cut_up(&flat(&U)).len(), 6);
    assert_eq!(cut_up(&flat(&WINDOW)).len(), 8);
}

#[test]
fn small_convex_polygons_are_fans() {
    let pentagon = flat(&[(0., 0.), (2., 0.), (3., 1.), (2., 2.), (0., 2.)]);
    assert_eq!(cut_up(&pentagon), [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    // A quad that is bent along its other diagonal keeps its diagonal.
    let mut bent = flat(&[(0., 0.), (1., 0.), (1., 1.), (0., 1.)]);
    bent[1].z = 0.5;
    assert_eq!(cut_up(&bent), [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn a_concave_quad_is_cut_through_its_notch() {
    for first in 0..4 {
        let points: Vec<DVec3> = flat(&DART).into_iter().cycle().skip(first).take(4).collect();
        let notch = (7 - first as u32) % 4;
        let triangles = cut_up(&points);
        assert!(
            triangles.len() == 2 && triangles.iter().all(|triangle| triangle.contains(&notch)),
            "{triangles:?}"
        );
    }
}

#[test]
fn what_has_no_area_is_still_a_face() {
    for points in [
        flat(&[(1., 1.); 5]),
        flat(&[(0., 0.), (1., 0.), (2., 0.), (3., 0.)]),
        flat(&[
            (0., 0.),
            (1., 1.),
            (2., 2.),
            (1., 1.),
            (0.5, 0.5),
            (0.2, 0.2),
            (0.1, 0.1),
            (0.3, 0.3),
            (0.4, 0.4),
        ]),
        vec![DVec3::splat(1e-310); 4],
    ] {
        assert!(!cut_up(&points).is_empty(), "{points:?}");
    }
    // A bow has two halves that cancel out.
    let bow = flat(&[(0., 0.), (1., 1.), (1., 0.), (0., 1.)]);
    assert_eq!(cut_up(&bow).len(), 2);
}

#[test]
fn outlines_that_cross_themselves_keep_their_area() {
    let star: Vec<(f64, f64)> = (0..5).map(|i| (TAU * f64::from(2 * i) / 5.0).sin_cos()).collect();
    let eight = [(0., 0.), (4., 0.), (0., 3.), (3., 3.), (1., -1.)];
    for corners in [&star[..], &eight] {
        let points = flat(corners);
        let sum: DVec3 = areas(&points, &cut_up(&points)).into_iter().sum();
        assert!((sum - area_of(&points)).length() < 1e-12, "{corners:?}");
    }
}

/// Deterministic pseudo-random numbers from 0 to 1.
fn chance(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    }
}

fn star_shaped(corners: usize, seed: u64) -> Vec<(f64, f64)> {
    let mut chance = chance(seed);
    (0..corners)
        .map(|i| {
            let (sin, cos) = (TAU * i as f64 / corners as f64).sin_cos();
            let radius = 0.2 + chance();
            (radius * cos, radius * sin)
        })
        .collect()
}

fn comb(teeth: usize) -> Vec<(f64, f64)> {
    let tooth = |i: usize| [(i as f64, 0.1), (i as f64 + 0.5, 100.0), (i as f64 + 1.0, 0.1)];
    let mut corners: Vec<(f64, f64)> = (0..teeth).flat_map(tooth).collect();
    corners.extend([(teeth as f64, 0.0), (0.0, 0.0)]);
    corners.reverse();
    corners
}

fn spiral(turns: usize, corners_a_turn: usize) -> Vec<(f64, f64)> {
    let count = turns * corners_a_turn;
    let at = |i: usize, inset: f64| {
        let turn = i as f64 / corners_a_turn as f64;
        let (sin, cos) = (TAU * turn).sin_cos();
        ((turn + 1.0 - inset) * cos, (turn + 1.0 - inset) * sin)
    };
    (0..count).map(|i| at(i, 0.0)).chain((0..count).rev().map(|i| at(i, 0.5))).collect()
}

#[test]
fn polygons_of_any_shape_are_filled() {
    for seed in 0..60 {
        assert_fills_everywhere(&star_shaped(4 + seed as usize, seed), &format!("star {seed}"));
    }
    assert_fills_everywhere(&comb(30), "comb");
    assert_fills_everywhere(&spiral(5, 40), "spiral");
}

#[test]
fn a_hundred_thousand_corners_take_seconds() {
    let disc = |digits: f64| -> Vec<(f64, f64)> {
        (0..100_000)
            .map(|i| (TAU * f64::from(i) / 100_000.0).sin_cos())
            .map(|(sin, cos)| ((cos * digits).round() / digits, (sin * digits).round() / digits))
            .collect()
    };
    let mut chance = chance(7);
    let tangle: Vec<(f64, f64)> = (0..100_000).map(|_| (chance(), chance())).collect();
    for (corners, simple, name) in [
        (disc(1e12), true, "disc"),
        (disc(1e9), true, "rounded disc"),
        (star_shaped(100_000, 1), true, "star"),
        (comb(33_333), true, "comb"),
        (spiral(50, 1000), true, "spiral"),
        (tangle, false, "tangle"),
    ] {
        let points = flat(&corners);
        let started = Instant::now();
        let triangles = cut_up(&points);
        let seconds = started.elapsed().as_secs_f64();
        eprintln!("{name}: {seconds:.3} s, {} triangles", triangles.len());
        // Optimised code takes a hundredth of it.
        assert!(seconds < 60.0, "{name}: {seconds} s");
        if simple {
            assert_fills(&points, name);
        }
    }
}

#[test]
fn no_corner_has_more_than_its_share_of_slivers() {
    let disc: Vec<DVec3> = (0..4096)
        .map(|i| (TAU * f64::from(i) / 4096.0).sin_cos())
        .map(|(sin, cos)| DVec3::new(cos, sin, 0.0))
        .collect();
    let mut uses = vec![0; disc.len()];
    for corner in cut_up(&disc).into_iter().flatten() {
        uses[corner as usize] += 1;
    }
    assert!(uses.iter().all(|&uses| (1..=26).contains(&uses)), "{:?}", uses.iter().max());
}
