//! A fig in a terracotta pot, and a vase of dry grasses.

use glam::{DVec2, DVec3};

use super::palette::{BARK, EARTH, LEAVES, LINEN, MUSTARD, TEAL, TERRACOTTA};
use crate::generator::angle::{heading, turn_x, turn_y, turn_z};
use crate::generator::random::{between, pick};
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{Ends, Path, grid, lathe, spline, tube};

/// The fig, about 1.9 m high, its pot round the origin.
pub(crate) fn fig() -> Model {
    let mut model = Model::default();
    let pot = spline(
        &[
            (0.0, 0.0),
            (0.145, 0.0),
            (0.145, 0.0),
            (0.19, 0.27),
            (0.192, 0.29),
            (0.192, 0.29),
            (0.212, 0.292),
            (0.215, 0.30),
            (0.218, 0.345),
            (0.212, 0.352),
            (0.196, 0.35),
            (0.19, 0.30),
        ],
        3,
    );
    model.add(&TERRACOTTA, lathe(&pot, 56));
    model.add(&EARTH, lathe(&[DVec2::new(0.192, 0.305), DVec2::new(0.0, 0.32)], 24));
    for (stem, (turn, spread, height)) in
        [(20.0, 0.16, 1.62), (150.0, 0.22, 1.30), (265.0, 0.20, 1.05)].into_iter().enumerate()
    {
        add_stem(&mut model, stem as u64, heading(turn), spread, height);
    }
    model
}

/// A stem that leaves the pot towards `side`, with leaves in a spiral up to a crown.
fn add_stem(model: &mut Model, stem: u64, side: DVec3, spread: f64, height: f64) {
    let along = |t: f64| side * (0.03 + spread * t * t) + DVec3::Y * (0.30 + height * t);
    let points = (0..=10).map(|i| along(f64::from(i) / 10.0)).collect();
    model.add(&BARK, tube(&Path::new(points, side.cross(DVec3::Y), Ends::Open), 8, |t| 0.016 - 0.009 * t));
    let leaves = (height * 17.0) as u64;
    for place in 0..leaves {
        let index = stem * 100 + place;
        let t = 0.28 + 0.72 * place as f64 / (leaves - 1) as f64;
        let turn = 137.5 * place as f64 + 60.0 * stem as f64 + between(50, index, -15.0, 15.0);
        let length = between(51, index, 0.22, 0.32) * (1.12 - 0.45 * t * t);
        let rise = 15.0 + 55.0 * t * t * t + between(52, index, -10.0, 10.0);
        let leaf = leaf(length, between(53, index, 0.35, 0.75))
            .mapped(|p| turn_y(turn_x(p, -rise), turn) + along(t));
        model.add(pick(54, index, &LEAVES.each_ref()), leaf);
    }
}

/// A fiddle-shaped leaf from the origin along +Z, folded along its midrib, its tip bent down by `droop`.
fn leaf(length: f64, droop: f64) -> Shape {
    let outline = spline(
        &[
            (0.0, 0.0),
            (0.012, 0.1),
            (0.10, 0.18),
            (0.215, 0.3),
            (0.22, 0.42),
            (0.25, 0.6),
            (0.30, 0.75),
            (0.25, 0.9),
            (0.12, 0.975),
            (0.0, 1.0),
        ],
        1,
    );
    let across = 5;
    let blade = grid((across, Ends::Open), (outline.len(), Ends::Open), |column, row| {
        let (half_width, along) = (outline[row].x, outline[row].y);
        let u = 2.0 * column as f64 / (across - 1) as f64 - 1.0;
        let ripple = 0.02 * u.abs() * super::super::angle::sin(along * 1440.0);
        let height = 0.14 * u.abs() * half_width * 2.0 + ripple - droop * along * along * 0.5;
        DVec3::new(-u * half_width, height, along) * length
    });
    let rib = Path::new(
        (0..=6)
            .map(|i| f64::from(i) / 6.0)
            .map(|z| DVec3::new(0.0, 0.004 - droop * z * z * 0.5, z) * length)
            .collect(),
        DVec3::X,
        Ends::Open,
    );
    Shape::union([blade, tube(&rib, 3, |t| 0.0032 * (1.0 - 0.8 * t))])
}

/// A tall vase with grasses and three round seed heads, its foot round the origin.
pub(crate) fn grasses() -> Model {
    let mut model = Model::default();
    let vase = spline(
        &[
            (0.0, 0.0),
            (0.06, 0.0),
            (0.06, 0.0),
            (0.09, 0.06),
            (0.108, 0.14),
            (0.09, 0.22),
            (0.05, 0.29),
            (0.042, 0.33),
            (0.055, 0.37),
            (0.05, 0.37),
            (0.037, 0.33),
            (0.04, 0.29),
        ],
        6,
    );
    model.add(&TEAL, lathe(&vase, 56));
    for index in 0..26 {
        let blade = stalk(between(60, index, 0.45, 0.85), between(61, index, 0.05, 0.34));
        let turn = 137.5 * index as f64;
        let material = if index % 3 == 0 { &MUSTARD } else { &LINEN };
        model.add(material, blade.turned_y(turn).at(0.0, 0.30, 0.0));
    }
    model
}

/// A stalk in the YZ plane that bends outwards and carries an ear.
fn stalk(height: f64, bend: f64) -> Shape {
    let along = |t: f64| DVec3::new(0.0, height * t, 0.02 + bend * t * t);
    let points = (0..=8).map(|i| along(f64::from(i) / 8.0)).collect();
    let stem = tube(&Path::new(points, DVec3::X, Ends::Open), 5, |t| 0.0022 - 0.001 * t);
    let profile = spline(&[(0.0, -0.06), (0.009, -0.03), (0.012, 0.0), (0.007, 0.05), (0.0, 0.085)], 3);
    let lean = libm::atan2(2.0 * bend, height).to_degrees();
    let tip = along(1.0);
    let ear = lathe(&profile, 8).mapped(|p| turn_x(turn_z(p, 0.0), lean) + tip);
    Shape::union([stem, ear])
}
