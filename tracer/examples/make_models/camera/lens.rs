//! The lens: mount, barrel with two knurled rings, scales, glass. Made standing on the origin, looking up +Y.

use glam::DVec3;

use super::{BLACK, BODY, CHROME, ENGRAVING, GLASS, LENS, RED, knurled};
use crate::generator::angle::turn_x;
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{Path, lathe, plain_box, spline, tube};

/// Profiles of (radius, distance from the body), from the body outwards.
const MOUNT: [(f64, f64); 7] =
    [(2.45, 0.0), (2.45, 0.25), (2.45, 0.25), (2.36, 0.34), (2.05, 0.36), (2.05, 0.36), (2.05, 0.5)];
const BARREL: [(f64, f64); 5] = [(2.12, 0.4), (2.12, 0.9), (2.12, 0.9), (2.06, 0.96), (1.9, 0.98)];
const FOCUS_RING: [(f64, f64); 8] = [
    (1.9, 0.95),
    (2.2, 1.02),
    (2.24, 1.08),
    (2.24, 1.08),
    (2.24, 1.75),
    (2.24, 1.75),
    (2.2, 1.82),
    (1.85, 1.86),
];
const FRONT_BARREL: [(f64, f64); 5] = [(1.88, 1.82), (1.88, 2.35), (1.88, 2.35), (1.84, 2.40), (1.7, 2.40)];
const APERTURE_RING: [(f64, f64); 8] = [
    (1.7, 2.36),
    (1.92, 2.42),
    (1.94, 2.46),
    (1.94, 2.46),
    (1.94, 2.75),
    (1.94, 2.75),
    (1.9, 2.8),
    (1.72, 2.82),
];
/// Over the front edge and in steps down to the glass.
const RIM: [(f64, f64); 13] = [
    (1.74, 2.8),
    (1.76, 3.25),
    (1.72, 3.32),
    (1.64, 3.32),
    (1.62, 3.28),
    (1.62, 3.28),
    (1.56, 3.12),
    (1.36, 2.98),
    (1.36, 2.98),
    (1.34, 2.90),
    (1.16, 2.84),
    (1.16, 2.84),
    (1.14, 2.7),
];
const FRONT_GLASS: [(f64, f64); 5] = [(1.18, 2.50), (1.0, 2.67), (0.7, 2.84), (0.35, 2.93), (0.0, 2.96)];

/// The lens on the camera's front.
pub(super) fn lens() -> Model {
    let mut model = Model::default();
    model.add(&CHROME, turned(&MOUNT, 80));
    model.add(&BLACK, turned(&BARREL, 80));
    model.add(&CHROME, knurled(turned(&FOCUS_RING, 256), 2.21, 64, 0.09));
    model.add(&BLACK, turned(&FRONT_BARREL, 80));
    model.add(&CHROME, knurled(turned(&APERTURE_RING, 160), 1.91, 40, 0.08));
    model.add(&BLACK, turned(&RIM, 72));
    model.add(&CHROME, tube(&Path::circle(1.68, 3.31, 72), 6, |_| 0.03));
    model.add(&GLASS, turned(&FRONT_GLASS, 64));
    model.add(&ENGRAVING, scale(2.125, 0.53, 60, 0.3));
    model.add(&ENGRAVING, scale(1.885, 1.97, 48, 0.26));
    model.add(&RED, turned(&[(0.0, -0.1), (0.13, -0.02), (0.0, 0.06)], 20).at(0.0, 0.33, -2.22));
    model.mapped(|p| turn_x(p, 90.0) + DVec3::new(LENS.x, LENS.y, BODY.z / 2.0 + 0.2))
}

fn turned(profile: &[(f64, f64)], segments: usize) -> Shape {
    lathe(&spline(profile, 3), segments)
}

/// Engraved ticks round a barrel of `radius`, from `start` along the lens: every fifth is `length` long, the others
/// half of it.
fn scale(radius: f64, start: f64, count: u32, length: f64) -> Shape {
    Shape::union((0..count).map(|tick| {
        let length = if tick % 5 == 0 { length } else { 0.5 * length };
        let half = DVec3::new(0.018, length / 2.0, 0.01);
        let mark = plain_box(-half, half).at(0.0, start + length / 2.0, radius);
        mark.turned_y(360.0 * f64::from(tick) / f64::from(count))
    }))
}
