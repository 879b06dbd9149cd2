//! The sofa, the armchair, and their pillows. Each stands on the floor round the origin and faces +Z.

use glam::{DVec2, DVec3};

use super::palette::{CREAM, CREAM_DARK, MUSTARD, OAK, RUST, RUST_DARK, TEAL, WALNUT};
use crate::generator::angle::{cos, turn_x, unit};
use crate::generator::shape::{Material, Model, Shape};
use crate::generator::shapes::{
    Ends, Path, Softness, cushion, lathe, pillow, rounded_box, spline, sweep, tube,
};

/// Upholstery over a hard frame.
const FIRM: Softness = Softness { radius: 0.055, corner_steps: 3, flat_steps: 3 };
/// Loose cushions.
const PLUMP: Softness = Softness { radius: 0.05, corner_steps: 3, flat_steps: 4 };
/// Thickness of the cord in a seam.
const PIPING: f64 = 0.006;

/// A three-seater, 2.2 m wide.
pub(crate) fn sofa() -> Model {
    let mut model = Model::default();
    let (width, depth, seat_width) = (2.2, 0.94, 0.6);
    let inner = 3.0 * seat_width;
    let arm = (width - inner) / 2.0;
    model.add(&RUST, rounded_box(DVec3::new(width - 0.06, 0.2, depth - 0.06), FIRM).at(0.0, 0.25, 0.0));
    for side in [-1.0, 1.0] {
        let x = side * (inner + arm) / 2.0;
        model.add(
            &RUST,
            rounded_box(DVec3::new(arm - 0.004, 0.5, depth), Softness { radius: 0.085, ..FIRM })
                .at(x, 0.40, 0.0),
        );
    }
    let back = rounded_box(DVec3::new(width - 0.02, 0.68, 0.2), Softness { radius: 0.09, ..FIRM });
    model.add(&RUST, back.turned_x(-7.0).at(0.0, 0.53, -0.38));
    for place in [-1.0, 0.0, 1.0] {
        let seat = piped_cushion(DVec3::new(seat_width - 0.006, 0.17, 0.70), 0.022, &RUST, &RUST_DARK);
        model.include(seat.at(place * seat_width, 0.405, 0.11));
        let rest = piped_cushion(DVec3::new(seat_width - 0.012, 0.17, 0.43), 0.03, &RUST, &RUST_DARK);
        let lean = |p: DVec3| turn_x(p, 76.0) + DVec3::new(place * seat_width, 0.685, -0.20);
        model.include(rest.mapped(lean));
    }
    for (x, z) in [(-1.0, -0.38), (1.0, -0.38), (-1.0, 0.38), (1.0, 0.38)] {
        model.add(&WALNUT, lathe(&turned_foot(0.16), 16).at(x, 0.0, z));
    }
    model.include(throw_pillow(&MUSTARD, 0.46).at(0.0, 0.0, 0.0).mapped(|p| settle(p, -0.70, 22.0)));
    model.include(throw_pillow(&TEAL, 0.40).mapped(|p| settle(p + DVec3::Z * 0.13, -0.52, -14.0)));
    model.include(throw_pillow(&TEAL, 0.46).mapped(|p| settle(p, 0.70, -20.0)));
    model
}

/// Leans a pillow that faces +Z against the sofa's back at `x`, rolled by `roll` degrees.
fn settle(p: DVec3, x: f64, roll: f64) -> DVec3 {
    let rolled = super::super::angle::turn_z(p, 0.35 * roll);
    turn_x(super::super::angle::turn_y(rolled, -roll), -22.0) + DVec3::new(x, 0.70, 0.03)
}

fn throw_pillow(material: &'static Material, size: f64) -> Model {
    let mut model = Model::default();
    model.add(material, pillow(DVec3::new(size, size, 0.17), 18));
    model
}

/// A cushion with a cord along its upper and lower edge.
fn piped_cushion(size: DVec3, bulge: f64, cloth: &'static Material, cord: &'static Material) -> Model {
    let mut model = Model::default();
    model.add(cloth, cushion(size, PLUMP, bulge));
    // Where the rounding is at 45 degrees.
    let inset = PLUMP.radius * (1.0 - cos(45.0));
    for side in [-1.0, 1.0] {
        let loop_ = rounded_rectangle(
            size.x - 2.0 * inset,
            size.z - 2.0 * inset,
            PLUMP.radius,
            side * (size.y / 2.0 - inset),
        );
        model.add(cord, tube(&loop_, 6, |_| PIPING));
    }
    model
}

/// A closed path round a rectangle in the floor plane at `height`.
fn rounded_rectangle(width: f64, depth: f64, radius: f64, height: f64) -> Path {
    let mut points = Vec::new();
    for corner in 0..4 {
        let quadrant = 90.0 * f64::from(corner);
        let middle = unit(quadrant + 45.0);
        let (x, z) = (middle.x.signum() * (width / 2.0 - radius), middle.y.signum() * (depth / 2.0 - radius));
        for step in 0..=4 {
            let p = unit(quadrant + 22.5 * f64::from(step)) * radius;
            points.push(DVec3::new(x + p.x, height, z + p.y));
        }
    }
    Path::new(points, DVec3::Y, Ends::Joined)
}

fn turned_foot(height: f64) -> Vec<DVec2> {
    let scaled = [
        (0.0, 0.0),
        (0.014, 0.0),
        (0.018, 0.06),
        (0.016, 0.12),
        (0.028, 0.55),
        (0.034, 0.8),
        (0.024, 0.86),
        (0.024, 0.9),
        (0.034, 0.94),
        (0.034, 1.0),
        (0.0, 1.0),
    ];
    spline(&scaled.map(|(radius, part)| (radius, part * height)), 2)
}

/// A lounge chair: two loose cushions in an open frame of oak.
pub(crate) fn armchair() -> Model {
    let mut model = Model::default();
    let tilt = -8.0;
    let lean = |p: DVec3| turn_x(p, 66.0) + DVec3::new(0.0, 0.66, -0.27);
    let seat = |p: DVec3| turn_x(p, tilt) + DVec3::new(0.0, 0.40, 0.06);
    model.include(piped_cushion(DVec3::new(0.60, 0.15, 0.64), 0.03, &CREAM, &CREAM_DARK).mapped(seat));
    model.include(piped_cushion(DVec3::new(0.60, 0.15, 0.62), 0.03, &CREAM, &CREAM_DARK).mapped(lean));
    for side in [-1.0, 1.0] {
        model.add(&OAK, side_frame().mapped(|p| DVec3::new(side * (0.345 + p.z * side), p.y, p.x)));
    }
    model.add(&OAK, rails());
    model
}

/// One side of the chair's frame in the XY plane, X forwards: an arm that runs down into the front leg, the back leg.
fn side_frame() -> Shape {
    let arm = Path::in_xy(
        &[
            (-0.47, 0.595),
            (-0.36, 0.605),
            (-0.1, 0.60),
            (0.16, 0.602),
            (0.285, 0.59),
            (0.33, 0.545),
            (0.338, 0.46),
            (0.335, 0.2),
            (0.34, 0.0),
        ],
        7,
    );
    // Wide and thin where the hand rests, squarer towards the foot.
    let arm_section = |t: f64, corner: usize| {
        let flat = 1.0 - (t - 0.35).clamp(0.0, 0.3) / 0.3;
        superellipse(corner, 12, 0.019 + 0.012 * flat, 0.019 - 0.004 * flat - 0.004 * (t - 0.6).max(0.0))
    };
    let leg = Path::in_xy(&[(-0.50, 0.0), (-0.44, 0.24), (-0.395, 0.45), (-0.40, 0.60)], 5);
    let brace = Path::in_xy(&[(-0.42, 0.33), (0.0, 0.345), (0.335, 0.37)], 5);
    Shape::union([
        sweep(&arm, 12, arm_section),
        sweep(&leg, 12, |t, corner| superellipse(corner, 12, 0.014 + 0.008 * t, 0.016)),
        sweep(&brace, 12, |_, corner| superellipse(corner, 12, 0.018, 0.012)),
    ])
}

/// A rounded rectangle as a section: a superellipse of degree 4.
fn superellipse(corner: usize, corners: usize, half_width: f64, half_height: f64) -> DVec2 {
    let direction = unit(360.0 * corner as f64 / corners as f64);
    let root = |c: f64| c.signum() * c.abs().sqrt();
    DVec2::new(root(direction.x) * half_width, root(direction.y) * half_height)
}

/// What holds the two sides together: front and back rail, three slats behind the cushion.
fn rails() -> Shape {
    let across = |half_width: f64, y: f64, z: f64, half_height: f64, half_depth: f64| {
        let path = Path::line(DVec3::new(-half_width, y, z), DVec3::new(half_width, y, z), 1);
        sweep(&path, 12, move |_, corner| superellipse(corner, 12, half_depth, half_height))
    };
    let slats = [0.48, 0.66, 0.84, 0.93].map(|y| across(0.26, y, -0.26 - 0.41 * (y - 0.42), 0.024, 0.008));
    let posts = [-0.22, 0.22].map(|x| {
        let path = Path::line(DVec3::new(x, 0.34, -0.262), DVec3::new(x, 0.97, -0.52), 1);
        sweep(&path, 12, |_, corner| superellipse(corner, 12, 0.018, 0.010))
    });
    let rails = [across(0.345, 0.365, 0.33, 0.03, 0.012), across(0.345, 0.33, -0.25, 0.03, 0.012)];
    Shape::union(slats.into_iter().chain(posts).chain(rails))
}
