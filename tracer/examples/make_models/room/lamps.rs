//! The hanging lamp and the reading lamp. Their light comes from the scene file: see the positions in its comments.

use glam::{DVec2, DVec3};

use super::palette::{BRASS, BULB, ENAMEL, IRON};
use crate::generator::angle::{heading, turn_x, unit};
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{Path, lathe, spline, tube};

/// A lamp of three nested shades. The origin is where its light is; the cord runs up `cord` metres.
pub(crate) fn pendant(cord: f64) -> Model {
    let mut model = Model::default();
    model.add(&ENAMEL, shade(&[(0.30, -0.055), (0.27, -0.03), (0.20, 0.005), (0.135, 0.028)]));
    model.add(&ENAMEL, shade(&[(0.205, 0.072), (0.17, 0.092), (0.12, 0.108), (0.08, 0.115)]));
    model.add(&ENAMEL, shade(&[(0.125, 0.145), (0.105, 0.168), (0.06, 0.188), (0.02, 0.195)]));
    model.add(&BRASS, tube(&Path::line(DVec3::Y * 0.19, DVec3::Y * 0.23, 1), 16, |_| 0.022));
    model.add(&IRON, tube(&Path::line(DVec3::Y * 0.22, DVec3::Y * cord, 1), 8, |_| 0.0035));
    let cap = spline(&[(0.05, cord - 0.035), (0.055, cord - 0.03), (0.05, cord - 0.01), (0.04, cord)], 4);
    model.add(&BRASS, lathe(&cap, 24));
    for strut in 0..3 {
        let side = heading(120.0 * f64::from(strut));
        let (low, high) = (side * 0.15 + DVec3::Y * 0.022, side * 0.055 + DVec3::Y * 0.19);
        model.add(&BRASS, tube(&Path::line(low, high, 1), 6, |_| 0.003));
    }
    model.add(&BULB, bulb().at(0.0, 0.045, 0.0));
    model
}

/// A thin turned shell: the curve through `points` of (radius, height), outside and inside.
fn shade(points: &[(f64, f64)]) -> Shape {
    let thickness = 0.003;
    let outer = spline(points, 4);
    let inner = outer.iter().rev().map(|p| *p - DVec2::new(0.3 * thickness, thickness));
    let mut profile: Vec<DVec2> = outer.iter().copied().chain(inner).collect();
    profile.push(outer[0]);
    lathe(&profile, 72)
}

/// A bulb whose lower end is just above the origin, so that a light there shines on it.
fn bulb() -> Shape {
    let profile = spline(
        &[
            (0.0, -0.03),
            (0.018, -0.024),
            (0.028, -0.004),
            (0.024, 0.018),
            (0.013, 0.04),
            (0.012, 0.075),
            (0.0, 0.08),
        ],
        4,
    );
    lathe(&profile, 24)
}

/// Height of the reading lamp's joint and reach of its arm.
const JOINT: f64 = 1.38;
const REACH: f64 = 0.44;
/// How far its head looks down from straight ahead.
pub(crate) const HEAD_PITCH: f64 = 58.0;

/// A reading lamp: its foot round the origin, its arm towards +Z, its head looking down and ahead.
pub(crate) fn reading_lamp() -> Model {
    let mut model = Model::default();
    let foot = spline(
        &[
            (0.0, 0.0),
            (0.15, 0.0),
            (0.15, 0.0),
            (0.152, 0.012),
            (0.14, 0.02),
            (0.03, 0.03),
            (0.014, 0.05),
            (0.0, 0.05),
        ],
        4,
    );
    model.add(&IRON, lathe(&foot, 56));
    let neck = DVec3::new(0.0, JOINT, 0.0);
    model.add(&BRASS, tube(&Path::line(DVec3::Y * 0.03, neck, 1), 12, |_| 0.010));
    let bow = (0..=20).map(|i| {
        let t = f64::from(i) / 20.0;
        let p = unit(180.0 - 150.0 * t);
        DVec3::new(0.0, JOINT + 0.20 * p.y, REACH / 1.866 * (1.0 + p.x))
    });
    let arm = Path::new(bow.collect(), DVec3::X, crate::generator::shapes::Ends::Open);
    let end = arm.end();
    model.add(&BRASS, tube(&arm, 12, |_| 0.009));
    let head = |shape: Shape| shape.mapped(|p| turn_x(p, HEAD_PITCH - 90.0) + end);
    model.add(&BRASS, head(hood()));
    model.add(&ENAMEL, head(hood_lining()));
    model.add(&BULB, head(bulb().at(0.0, -0.10, 0.0)));
    model
}

/// The head's outside, hanging down from the origin.
fn hood() -> Shape {
    let profile = spline(
        &[
            (0.105, -0.21),
            (0.103, -0.17),
            (0.085, -0.11),
            (0.055, -0.065),
            (0.034, -0.045),
            (0.03, 0.0),
            (0.03, 0.0),
            (0.02, 0.012),
            (0.0, 0.014),
        ],
        5,
    );
    lathe(&profile, 48)
}

fn hood_lining() -> Shape {
    let profile = spline(
        &[
            (0.0, -0.05),
            (0.03, -0.052),
            (0.052, -0.07),
            (0.081, -0.113),
            (0.1, -0.172),
            (0.102, -0.21),
            (0.105, -0.21),
        ],
        4,
    );
    lathe(&profile, 48)
}
