//! Walls, ceiling, and the woodwork on them: panelling, chair rail, baseboard, cornice.

use glam::{DVec2, DVec3};

use super::palette::{PLASTER, WALL, WOODWORK};
use super::plan::{HALF_X, HALF_Z, HEIGHT, Opening, RAIL, THICKNESS, Wall};
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{lathe_every, plain_box, rectangle_moulding, spline, straight_moulding};

/// Sections of the strips, (height, depth) or (inwards, height) as the moulding expects them.
const BASEBOARD: [(f64, f64); 7] = [
    (0.0, 0.022),
    (0.12, 0.022),
    (0.128, 0.018),
    (0.135, 0.02),
    (0.145, 0.014),
    (0.155, 0.008),
    (0.158, 0.0),
];
const CHAIR_RAIL: [(f64, f64); 8] = [
    (RAIL - 0.06, 0.012),
    (RAIL - 0.05, 0.018),
    (RAIL - 0.035, 0.02),
    (RAIL - 0.02, 0.034),
    (RAIL - 0.012, 0.038),
    (RAIL - 0.004, 0.036),
    (RAIL, 0.03),
    (RAIL, 0.0),
];
const PANEL: [(f64, f64); 6] =
    [(0.0, 0.012), (0.004, 0.022), (0.014, 0.026), (0.024, 0.02), (0.028, 0.014), (0.034, 0.012)];
/// Width of the solid strip that carries the panels.
const STILE: f64 = 0.10;
/// Thickness of the panelling.
const BOARDING: f64 = 0.012;
/// About how wide a panel is.
const PANEL_WIDTH: f64 = 0.78;
/// Width of the casing round doors and windows, which the woodwork stops at.
pub(crate) const CASING: f64 = 0.09;

/// The walls with everything fixed to them that is flat-sided, in the room's frame.
pub(crate) fn walls() -> Model {
    let mut model = Model::default();
    for wall in Wall::ALL {
        model.add(&WALL, wall.place(masonry(wall)));
        model.add(&WOODWORK, wall.place(woodwork(wall)));
    }
    model.add(&PLASTER, ceiling());
    model.add(&PLASTER, cornice());
    model
}

/// The wall itself: full-height pieces beside the openings, and pieces under and over them.
fn masonry(wall: Wall) -> Shape {
    let end = wall.half_length() + THICKNESS;
    let piece = |left: f64, right: f64, low: f64, high: f64| {
        plain_box(DVec3::new(left, low, -THICKNESS), DVec3::new(right, high, 0.0))
    };
    let mut shape = Shape::default();
    for (left, right) in beside(wall.openings(), end, 0.0) {
        shape.add(piece(left, right, -0.1, HEIGHT));
    }
    for opening in wall.openings() {
        shape.add(piece(opening.left(), opening.right(), -0.1, opening.sill));
        shape.add(piece(opening.left(), opening.right(), opening.head, HEIGHT));
    }
    shape
}

/// The stretches from `-end` to `end` that keep `margin` away from the openings.
fn beside(openings: &[Opening], end: f64, margin: f64) -> Vec<(f64, f64)> {
    let mut stretches = Vec::new();
    let mut left = -end;
    for opening in openings {
        stretches.push((left, opening.left() - margin));
        left = opening.right() + margin;
    }
    stretches.push((left, end));
    stretches
}

fn woodwork(wall: Wall) -> Shape {
    let mut shape = Shape::default();
    for (left, right) in beside(wall.openings(), wall.half_length(), CASING) {
        shape.add(straight_moulding(left, right, &BASEBOARD));
        shape.add(straight_moulding(left, right, &CHAIR_RAIL));
        shape.add(panelling(left, right, RAIL - 0.06));
    }
    for window in wall.openings().iter().filter(|opening| opening.sill > 0.0) {
        shape.add(straight_moulding(window.left() - CASING, window.right() + CASING, &BASEBOARD));
        shape.add(panelling(window.left() - CASING, window.right() + CASING, window.sill - 0.07));
    }
    shape
}

/// Boarding from the baseboard to `top`, with a row of raised frames.
fn panelling(left: f64, right: f64, top: f64) -> Shape {
    let bottom = 0.15;
    let count = ((right - left) / PANEL_WIDTH).round().max(1.0);
    let pitch = (right - left - STILE) / count;
    let size = DVec2::new(pitch - STILE, top - bottom - 1.5 * STILE);
    let middle = bottom + 0.9 * STILE + size.y / 2.0;
    let mut shape = plain_box(DVec3::new(left, 0.0, -0.01), DVec3::new(right, top, BOARDING));
    for i in 0..count as usize {
        let x = left + STILE / 2.0 + pitch * (i as f64 + 0.5);
        shape.add(rectangle_moulding(size, &PANEL).at(x, middle, 0.0));
    }
    shape
}

fn ceiling() -> Shape {
    let outer = DVec3::new(HALF_X + THICKNESS, 0.0, HALF_Z + THICKNESS);
    plain_box(-outer + DVec3::Y * HEIGHT, outer + DVec3::Y * (HEIGHT + 0.2))
}

/// The profiled strip under the ceiling, all round.
fn cornice() -> Shape {
    let section = [
        (0.0, 0.20),
        (0.012, 0.20),
        (0.016, 0.185),
        (0.03, 0.18),
        (0.034, 0.15),
        (0.05, 0.11),
        (0.08, 0.075),
        (0.12, 0.05),
        (0.125, 0.03),
        (0.145, 0.026),
        (0.15, 0.0),
    ];
    let size = DVec2::new(2.0 * HALF_X, 2.0 * HALF_Z);
    rectangle_moulding(size, &section).turned_x(90.0).at(0.0, HEIGHT, 0.0)
}

/// The plaster rose round the hanging lamp's hook, with petals.
pub(crate) fn rosette() -> Shape {
    let profile = spline(
        &[
            (0.0, -0.05),
            (0.05, -0.05),
            (0.07, -0.03),
            (0.11, -0.022),
            (0.2, -0.045),
            (0.27, -0.02),
            (0.30, -0.018),
            (0.33, -0.03),
            (0.36, -0.018),
            (0.37, 0.0),
        ],
        2,
    );
    let petals = |p: DVec3| {
        let radius = DVec2::new(p.x, p.z).length();
        let turns = libm::atan2(p.x, p.z).to_degrees() * 12.0;
        let depth =
            if (0.1..0.28).contains(&radius) { 0.25 * (1.0 + super::super::angle::cos(turns)) } else { 0.0 };
        DVec3::new(p.x, HEIGHT + p.y * (1.0 - depth), p.z)
    };
    lathe_every(&profile, 96).mapped(petals)
}
