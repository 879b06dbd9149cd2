//! The sideboard on the east wall: round the origin, its back at Z = 0, facing +Z.

use glam::{DVec2, DVec3};

use super::palette::{BRASS, OAK, WALNUT};
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{Path, beveled_box, lathe, rectangle_moulding, spline, tube};

/// Outer measures of the body.
const SIZE: DVec3 = DVec3::new(1.9, 0.52, 0.44);
/// Height of the legs.
const LEGS: f64 = 0.26;
/// Height of the top, on which things stand.
pub(crate) const TOP: f64 = LEGS + SIZE.y + 0.024;
/// Doors side by side.
const DOORS: usize = 4;

/// Body, top and doors: flat-sided.
pub(crate) fn body() -> Model {
    let mut model = Model::default();
    let middle = DVec3::new(0.0, LEGS + SIZE.y / 2.0, SIZE.z / 2.0 + 0.02);
    model.add(&WALNUT, beveled_box(SIZE, 0.004).at(middle.x, middle.y, middle.z));
    model.add(
        &WALNUT,
        beveled_box(DVec3::new(SIZE.x + 0.03, 0.024, SIZE.z + 0.02), 0.005).at(0.0, TOP - 0.012, middle.z),
    );
    let width = (SIZE.x - 0.04) / DOORS as f64;
    let front = SIZE.z + 0.02;
    for door in 0..DOORS {
        let x = width * (door as f64 - (DOORS as f64 - 1.0) / 2.0);
        model.add(&OAK, reeded_door(DVec2::new(width - 0.006, SIZE.y - 0.05)).at(x, middle.y, front));
    }
    model
}

/// A door of upright reeds in a frame.
fn reeded_door(size: DVec2) -> Shape {
    let frame = [(0.0, 0.0), (0.0, 0.014), (0.003, 0.017), (0.034, 0.017), (0.038, 0.012), (0.038, 0.0)];
    let inside = size - 0.076;
    let reeds = (inside.x / 0.021).round();
    let pitch = inside.x / reeds;
    let reed = beveled_box(DVec3::new(pitch - 0.0015, inside.y, 0.014), 0.0055);
    let row =
        (0..reeds as usize).map(|i| reed.clone().at(pitch * (i as f64 + 0.5) - inside.x / 2.0, 0.0, 0.002));
    Shape::union([rectangle_moulding(size, &frame)].into_iter().chain(row))
}

/// Legs and knobs: turned.
pub(crate) fn turned_parts() -> Model {
    let mut model = Model::default();
    let leg = spline(
        &[(0.0, 0.0), (0.011, 0.0), (0.013, 0.01), (0.024, LEGS - 0.03), (0.026, LEGS), (0.0, LEGS)],
        3,
    );
    for (x, z) in [(-0.84, 0.08), (0.84, 0.08), (-0.84, 0.40), (0.84, 0.40)] {
        model.add(&WALNUT, lathe(&leg, 16).at(x, 0.0, z));
    }
    for x in [-0.485, -0.445, 0.445, 0.485] {
        let (y, front) = (LEGS + SIZE.y / 2.0 + 0.06, SIZE.z + 0.036);
        model.add(
            &BRASS,
            tube(&Path::line(DVec3::new(x, y, front), DVec3::new(x, y, front + 0.022), 1), 10, |t| {
                0.006 + 0.006 * t
            }),
        );
    }
    model
}

/// A pair of candlesticks with candles, on the origin's height.
pub(crate) fn candlesticks() -> Model {
    let mut model = Model::default();
    for (x, z, height) in [(-0.06, 0.0, 0.24), (0.08, 0.05, 0.17)] {
        let stick = spline(
            &[
                (0.0, 0.0),
                (0.048, 0.0),
                (0.05, 0.006),
                (0.03, 0.016),
                (0.012, 0.028),
                (0.009, 0.05),
                (0.015, 0.065),
                (0.008, 0.08),
                (0.0075, height - 0.04),
                (0.014, height - 0.03),
                (0.009, height - 0.02),
                (0.026, height - 0.008),
                (0.027, height - 0.003),
                (0.012, height),
                (0.0, height),
            ],
            4,
        );
        model.add(&BRASS, lathe(&stick, 28).at(x, 0.0, z));
        let candle = spline(
            &[
                (0.0105, height - 0.002),
                (0.0105, height + 0.155),
                (0.0105, height + 0.155),
                (0.009, height + 0.161),
                (0.0, height + 0.158),
            ],
            3,
        );
        model.add(&super::palette::CREAM, lathe(&candle, 16).at(x, 0.0, z));
        model.add(
            &super::palette::IRON,
            tube(
                &Path::line(DVec3::new(x, height + 0.157, z), DVec3::new(x, height + 0.172, z), 1),
                5,
                |_| 0.001,
            ),
        );
    }
    model
}
