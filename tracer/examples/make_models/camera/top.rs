//! The raised top: housing, windows, dials, release, winder, accessory shoe.

use glam::{DVec2, DVec3};

use super::{BLACK, BODY, CHROME, ENGRAVING, ROOF, STANDS_AT, WINDOW, knurled};
use crate::generator::angle::unit;
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{
    Ends, Path, Softness, beveled_box, disc, lathe, lathe_every, rectangle_moulding, rounded_box, spline,
    sweep,
};

/// Where the raised top begins.
const BASE: f64 = STANDS_AT + BODY.y;
/// Where the dials and the shoe stand: middles on the plates, (x, z).
const WINDER: DVec2 = DVec2::new(4.75, -0.15);
const REWIND: DVec2 = DVec2::new(-5.75, -0.15);
const SPEEDS: DVec2 = DVec2::new(2.55, -0.2);
const RELEASE: DVec2 = DVec2::new(6.15, 0.35);
const SHOE: DVec2 = DVec2::new(-1.1, -0.05);

/// Everything above the body.
pub(super) fn top() -> Model {
    let mut model = housing();
    let on_plate = |shape: Shape, place: DVec2| shape.at(place.x, BASE - 0.02, place.y);
    model.add(&CHROME, on_plate(dial(0.88, 0.62, 48), WINDER));
    model.add(&CHROME, on_plate(dial(0.80, 0.95, 40), REWIND));
    model.add(&CHROME, on_plate(release(), RELEASE));
    model.add(&CHROME, lever());
    model.add(&CHROME, shoe().at(SHOE.x, ROOF, SHOE.y));
    model.include(speed_dial().at(SPEEDS.x, ROOF, SPEEDS.y));
    model
}

/// The raised box and its three windows.
fn housing() -> Model {
    let mut model = Model::default();
    let size = DVec3::new(8.6, ROOF - BASE + 0.1, 2.5);
    let soft = Softness { radius: 0.16, corner_steps: 3, flat_steps: 2 };
    model.add(&CHROME, rounded_box(size, soft).at(-0.6, BASE + size.y / 2.0 - 0.1, 0.0));
    for (x, width, height) in [(2.75, 1.25, 0.78), (0.2, 1.0, 0.62), (-3.6, 1.45, 0.85)] {
        model.include(window(DVec2::new(width, height)).at(x, BASE + 0.56, size.z / 2.0));
    }
    model
}

/// A knurled dial with a black face and ten marks.
fn speed_dial() -> Model {
    let mut model = Model::default();
    model.add(&CHROME, dial(0.72, 0.42, 36).at(0.0, -0.02, 0.0));
    let face = [DVec2::new(0.5, 0.0), DVec2::new(0.5, 0.012), DVec2::new(0.0, 0.012)];
    model.add(&BLACK, lathe(&face, 32).at(0.0, 0.40, 0.0));
    let mark = beveled_box(DVec3::new(0.03, 0.012, 0.14), 0.003).at(0.0, 0.414, 0.40);
    for place in 0..10 {
        model.add(&ENGRAVING, mark.clone().turned_y(36.0 * f64::from(place)));
    }
    model
}

/// The button in its collar.
fn release() -> Shape {
    let collar = [(0.36, 0.0), (0.36, 0.14), (0.30, 0.2), (0.22, 0.2), (0.22, 0.2)];
    let button = [(0.21, 0.34), (0.16, 0.37), (0.06, 0.34), (0.0, 0.33)];
    lathe(&spline(&[&collar[..], &button].concat(), 4), 32)
}

/// The winding lever, bent round its dial.
fn lever() -> Shape {
    let bow = (0..=12).map(|i| unit(60.0 - 14.0 * f64::from(i)) * 1.05);
    let points = bow.map(|p| DVec3::new(WINDER.x + p.x, BASE + 0.68, WINDER.y - p.y)).collect();
    let path = Path::new(points, DVec3::Y, Ends::Open);
    sweep(&path, 16, |t, corner| disc(corner, 16) * DVec2::new(0.22 - 0.08 * t, 0.07))
}

/// The accessory shoe: a plate between two rails with lips.
fn shoe() -> Shape {
    let plate = beveled_box(DVec3::new(2.0, 0.1, 2.0), 0.03).at(0.0, 0.03, 0.0);
    let lip = beveled_box(DVec3::new(0.32, 0.1, 1.9), 0.025);
    let rail = beveled_box(DVec3::new(0.12, 0.2, 1.9), 0.025);
    let sides = [-1.0, 1.0].map(|side| {
        Shape::union([lip.clone().at(side * 0.82, 0.24, 0.0), rail.clone().at(side * 0.93, 0.15, 0.0)])
    });
    Shape::union([plate].into_iter().chain(sides))
}

/// A framed pane round the origin, facing +Z.
fn window(size: DVec2) -> Model {
    let mut model = Model::default();
    let frame = [(0.0, -0.05), (0.0, 0.05), (0.03, 0.08), (0.09, 0.08), (0.12, 0.05), (0.13, -0.02)];
    model.add(&BLACK, rectangle_moulding(size, &frame));
    let pane = beveled_box(DVec3::new(size.x - 0.2, size.y - 0.2, 0.06), 0.02);
    model.add(&WINDOW, pane.at(0.0, 0.0, 0.01));
    model
}

/// A round dial with a knurled side, standing on the origin.
fn dial(radius: f64, height: f64, ridges: usize) -> Shape {
    let profile = [
        (0.86, 0.0),
        (0.86, 0.12),
        (1.0, 0.18),
        (1.0, 0.88),
        (0.91, 0.97),
        (0.80, 1.0),
        (0.78, 0.97),
        (0.0, 0.97),
    ];
    let profile: Vec<DVec2> = profile.iter().map(|&(r, y)| DVec2::new(r * radius, y * height)).collect();
    knurled(lathe_every(&profile, 4 * ridges), radius * 0.93, ridges, 0.035 * radius)
}
