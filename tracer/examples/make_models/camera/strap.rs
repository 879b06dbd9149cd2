//! Lugs, rings, and a strap that lies round the camera's back on the turntable.

use glam::{DVec2, DVec3};

use super::{BODY, CHROME, STANDS_AT, STRAP};
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{Ends, Path, lathe, spline, sweep, tube};

/// Width and thickness of the strap.
const WIDTH: f64 = 1.1;
const THICKNESS: f64 = 0.16;
/// Half of its way, from the right ring down and round the back to the middle.
const HALF_WAY: [DVec3; 8] = [
    DVec3::new(7.35, 5.13, 0.0),
    DVec3::new(7.72, 3.9, -0.15),
    DVec3::new(8.2, 2.0, -0.7),
    DVec3::new(8.9, 0.75, -2.0),
    DVec3::new(9.0, 0.2, -4.0),
    DVec3::new(7.6, 0.12, -6.4),
    DVec3::new(4.4, 0.12, -7.7),
    DVec3::new(0.0, 0.12, -7.2),
];
/// Above this height the strap hangs, below it lies.
const HANGS_ABOVE: f64 = 1.4;

/// The strap and what holds it.
pub(super) fn strap() -> Model {
    let mut model = Model::default();
    for side in [-1.0, 1.0] {
        let place = DVec3::new(side * (BODY.x / 2.0 + 0.12), STANDS_AT + 5.3, 0.0);
        let lug = lathe(&spline(&[(0.26, -0.2), (0.24, 0.05), (0.16, 0.2), (0.0, 0.22)], 3), 20);
        model.add(&CHROME, lug.turned_z(-90.0 * side).at(place.x - 0.05 * side, place.y, place.z));
        let ring = tube(&Path::circle(0.42, 0.0, 28), 8, |_| 0.055).turned_x(90.0);
        model.add(&CHROME, ring.at(place.x + side * 0.28, place.y - 0.3, 0.0));
    }
    model.add(&STRAP, leather());
    model
}

fn leather() -> Shape {
    let mirrored = HALF_WAY.iter().rev().skip(1).map(|p| DVec3::new(-p.x, p.y, p.z));
    let knots: Vec<DVec3> = HALF_WAY.iter().copied().chain(mirrored).collect();
    let path = curve(&knots, 6);
    let outwards = |p: &DVec3| if p.y > HANGS_ABOVE { DVec3::new(p.x.signum(), 0.25, 0.0) } else { DVec3::Y };
    let ups = smoothed(path.iter().map(outwards).collect());
    let (edge, half) = (WIDTH / 2.0 - 0.05, THICKNESS / 2.0);
    let section =
        [(-edge, -half), (edge, -half), (WIDTH / 2.0, 0.0), (edge, half), (-edge, half), (-WIDTH / 2.0, 0.0)];
    sweep(&Path::with_ups(path, ups, Ends::Open), section.len(), |_, corner| DVec2::from(section[corner]))
}

/// A curve in space through `knots`.
fn curve(knots: &[DVec3], steps: usize) -> Vec<DVec3> {
    let flat = |a: fn(&DVec3) -> f64, b: fn(&DVec3) -> f64| {
        spline(&knots.iter().map(|p| (a(p), b(p))).collect::<Vec<_>>(), steps)
    };
    let (xy, zy) = (flat(|p| p.x, |p| p.y), flat(|p| p.z, |p| p.y));
    xy.iter().zip(&zy).map(|(xy, zy)| DVec3::new(xy.x, xy.y, zy.x)).collect()
}

/// Each direction averaged with its neighbours, several times over.
fn smoothed(mut directions: Vec<DVec3>) -> Vec<DVec3> {
    for _ in 0..12 {
        let last = directions.len() - 1;
        let mean = |i: usize| {
            (directions[i.saturating_sub(1)] + directions[i] * 2.0 + directions[(i + 1).min(last)])
                .normalize_or(DVec3::Y)
        };
        directions = (0..=last).map(mean).collect();
    }
    directions
}
