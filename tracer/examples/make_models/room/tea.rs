//! The tea things: pot, cup on its saucer, spoon, sugar bowl, fruit bowl. Each stands at height 0 round the origin.

use glam::{DVec2, DVec3};

use super::palette::{BRASS, GLAZE, PORCELAIN, TEA};
use crate::generator::angle::unit;
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{Ends, Path, disc, grid, lathe, lathe_every, spline, sweep, tube};

/// A belly, a lid, a spout towards +X and a handle towards -X.
pub(crate) fn teapot() -> Model {
    let mut model = Model::default();
    let belly = spline(
        &[
            (0.0, 0.004),
            (0.046, 0.004),
            (0.05, 0.0),
            (0.054, 0.003),
            (0.053, 0.01),
            (0.053, 0.01),
            (0.082, 0.04),
            (0.095, 0.08),
            (0.085, 0.12),
            (0.058, 0.146),
            (0.05, 0.151),
            (0.05, 0.151),
            (0.047, 0.154),
            (0.044, 0.15),
        ],
        6,
    );
    model.add(&PORCELAIN, lathe(&belly, 56));
    let lid = spline(
        &[
            (0.047, 0.152),
            (0.046, 0.158),
            (0.03, 0.17),
            (0.012, 0.177),
            (0.007, 0.182),
            (0.0075, 0.187),
            (0.014, 0.195),
            (0.013, 0.205),
            (0.0, 0.209),
        ],
        5,
    );
    model.add(&PORCELAIN, lathe(&lid, 40));
    model.add(&GLAZE, ring(0.0951, 0.078, 0.004));
    model.add(&GLAZE, ring(0.0478, 0.1535, 0.0022));
    model.add(&PORCELAIN, spout());
    let handle = Path::in_xy(
        &[
            (-0.075, 0.128),
            (-0.105, 0.142),
            (-0.138, 0.135),
            (-0.153, 0.103),
            (-0.142, 0.068),
            (-0.112, 0.045),
            (-0.085, 0.048),
        ],
        8,
    );
    model.add(&GLAZE, sweep(&handle, 14, |_, corner| disc(corner, 14) * DVec2::new(0.0068, 0.0092)));
    model
}

fn ring(radius: f64, height: f64, thickness: f64) -> Shape {
    tube(&Path::circle(radius - 0.4 * thickness, height, 44), 6, |_| thickness)
}

/// Outside up to the lip, then a little way down inside.
fn spout() -> Shape {
    let outer = [(0.07, 0.052), (0.105, 0.065), (0.124, 0.1), (0.138, 0.135), (0.16, 0.152)];
    let path = Path::in_xy(&outer, 7);
    let inner = Path::in_xy(&[(0.1605, 0.1525), (0.14, 0.139), (0.128, 0.112)], 4);
    Shape::union([
        tube(&path, 16, |t| 0.022 - 0.0135 * t.sqrt()),
        // A dark mouth is only the unlit inside of a thin funnel: the lip hides its seam.
        tube(&inner, 16, |_| 0.0068),
    ])
}

/// A cup two thirds full on a saucer, its handle towards +X.
pub(crate) fn cup() -> Model {
    let mut model = Model::default();
    let saucer = spline(
        &[
            (0.0, 0.003),
            (0.034, 0.003),
            (0.038, 0.0),
            (0.042, 0.003),
            (0.06, 0.009),
            (0.074, 0.017),
            (0.0755, 0.019),
            (0.0735, 0.0192),
            (0.058, 0.0115),
            (0.04, 0.0065),
            (0.034, 0.0055),
            (0.0, 0.0055),
        ],
        4,
    );
    model.add(&PORCELAIN, lathe(&saucer, 44));
    let bowl = spline(
        &[
            (0.0, 0.008),
            (0.018, 0.008),
            (0.0205, 0.0055),
            (0.023, 0.008),
            (0.022, 0.012),
            (0.032, 0.022),
            (0.039, 0.04),
            (0.0415, 0.058),
            (0.0445, 0.066),
            (0.0452, 0.0673),
            (0.0435, 0.067),
            (0.0395, 0.057),
            (0.0365, 0.04),
            (0.029, 0.0235),
            (0.016, 0.0165),
            (0.0, 0.016),
        ],
        4,
    );
    model.add(&PORCELAIN, lathe(&bowl, 40));
    model.add(&GLAZE, ring(0.0452, 0.0668, 0.0011));
    model.add(&GLAZE, ring(0.0748, 0.0185, 0.0012));
    model.add(&TEA, surface(0.0395, 0.054));
    let handle = Path::in_xy(
        &[(0.0405, 0.055), (0.056, 0.061), (0.0665, 0.053), (0.064, 0.039), (0.052, 0.030), (0.036, 0.029)],
        7,
    );
    model.add(&PORCELAIN, sweep(&handle, 10, |_, corner| disc(corner, 10) * DVec2::new(0.0026, 0.0038)));
    model.include(spoon().turned_y(160.0).at(0.0, 0.0165, 0.056));
    model
}

/// A disc that faces up.
fn surface(radius: f64, height: f64) -> Shape {
    lathe(&[DVec2::new(radius, height), DVec2::new(0.0, height)], 32)
}

/// A spoon along X, its bowl towards +X.
fn spoon() -> Model {
    let mut model = Model::default();
    let bowl = grid((15, Ends::Open), (9, Ends::Open), |column, row| {
        let (u, v) = (-1.0 + 2.0 * column as f64 / 14.0, -1.0 + 2.0 * row as f64 / 8.0);
        let width = (1.0 - u * u).max(0.0).sqrt() * (0.0105 + 0.002 * u);
        DVec3::new(0.052 + 0.017 * u, 0.006 - 0.005 * (1.0 - u * u) * (1.0 - v * v), -width * v)
    });
    let stem = Path::in_xy(&[(0.037, 0.0055), (0.02, 0.009), (-0.02, 0.0075), (-0.055, 0.006)], 5);
    model.add(&BRASS, bowl);
    model.add(
        &BRASS,
        sweep(&stem, 8, |t, corner| disc(corner, 8) * DVec2::new(0.0016 + 0.003 * t * t, 0.0009)),
    );
    model
}

/// A lidded bowl for sugar.
pub(crate) fn sugar_bowl() -> Model {
    let mut model = Model::default();
    let profile = spline(
        &[
            (0.0, 0.004),
            (0.026, 0.004),
            (0.029, 0.0),
            (0.031, 0.004),
            (0.03, 0.009),
            (0.045, 0.026),
            (0.05, 0.046),
            (0.043, 0.066),
            (0.041, 0.07),
            (0.041, 0.07),
            (0.04, 0.075),
            (0.026, 0.085),
            (0.01, 0.09),
            (0.0055, 0.094),
            (0.0095, 0.101),
            (0.007, 0.108),
            (0.0, 0.11),
        ],
        4,
    );
    model.add(&PORCELAIN, lathe(&profile, 48));
    model.add(&GLAZE, ring(0.042, 0.0705, 0.0022));
    for side in [-1.0, 1.0] {
        let ear = Path::in_xy(&[(0.04, 0.058), (0.058, 0.062), (0.06, 0.045), (0.046, 0.038)], 6);
        let ear = tube(&ear, 8, |_| 0.0028).turned_y(if side > 0.0 { 0.0 } else { 180.0 });
        model.add(&GLAZE, ear);
    }
    model
}

/// A wide fluted bowl on a foot, for the oranges that the scene file puts into it.
pub(crate) fn fruit_bowl() -> Model {
    let mut model = Model::default();
    let profile = spline(
        &[
            (0.0, 0.006),
            (0.05, 0.006),
            (0.056, 0.0),
            (0.06, 0.003),
            (0.05, 0.018),
            (0.05, 0.024),
            (0.09, 0.04),
            (0.13, 0.075),
            (0.146, 0.105),
            (0.147, 0.109),
            (0.143, 0.107),
            (0.125, 0.078),
            (0.086, 0.046),
            (0.04, 0.033),
            (0.0, 0.032),
        ],
        2,
    );
    let flutes = |p: DVec3| {
        let radius = DVec2::new(p.x, p.z).length();
        let turns = libm::atan2(p.x, p.z).to_degrees() * 16.0;
        let depth = 0.028 * ((radius - 0.055) / 0.09).clamp(0.0, 1.0);
        let scale = 1.0 + depth * unit(turns).x;
        DVec3::new(p.x * scale, p.y, p.z * scale)
    };
    model.add(&GLAZE, lathe_every(&profile, 96).mapped(flutes));
    model
}
