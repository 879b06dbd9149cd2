//! Framed reliefs: a low sun over ridges, cut in layers.

use glam::{DVec2, DVec3};

use super::palette::{GILT, PICTURE, WALNUT};
use crate::generator::angle::sin;
use crate::generator::shape::{Material, Model, Shape};
use crate::generator::shapes::{Ends, grid, plain_box, rectangle_moulding};

/// Indices into the picture's colours.
const SKY: usize = 0;
const SUN: usize = 1;
const MOUNT: usize = 6;
/// Ridges, far to near: (colour, height of the middle line, swing) as parts of the picture's height.
const RIDGES: [(usize, f64, f64); 4] = [(2, 0.52, 0.05), (3, 0.40, 0.07), (4, 0.27, 0.06), (5, 0.13, 0.05)];
/// Thickness of one layer.
const LAYER: f64 = 0.006;

/// A picture of `size` (outside the frame) round the origin, its back at Z = 0, facing +Z.
fn picture(size: DVec2, seed: f64, frame_material: &'static Material) -> Model {
    let frame = [
        (0.0, 0.0),
        (0.0, 0.024),
        (0.004, 0.03),
        (0.012, 0.033),
        (0.018, 0.028),
        (0.024, 0.022),
        (0.036, 0.019),
        (0.04, 0.021),
        (0.045, 0.018),
        (0.046, 0.006),
    ];
    let mount = [(0.046, 0.007), (0.11, 0.007), (0.114, 0.003)];
    let mut model = Model::default();
    model.add(frame_material, rectangle_moulding(size, &frame));
    model.add(&PICTURE[MOUNT], rectangle_moulding(size, &mount));
    let inside = size - 0.224;
    model.add(&PICTURE[SKY], plain_box((-inside / 2.0).extend(-0.01), (inside / 2.0).extend(0.001)));
    model.add(&PICTURE[SUN], sun(inside, seed));
    for (layer, (colour, level, swing)) in RIDGES.into_iter().enumerate() {
        let phase = seed * 100.0 + 83.0 * layer as f64;
        model.add(&PICTURE[colour], ridge(inside, level, swing, phase, 0.002 + LAYER * (layer + 1) as f64));
    }
    model
}

/// A disc that stands out like a coin.
fn sun(inside: DVec2, seed: f64) -> Shape {
    let radius = 0.17 * inside.min_element();
    let profile = [(0.0, 0.001), (1.0, 0.001), (1.0, 0.004), (0.97, 0.005), (0.0, 0.005)];
    let profile: Vec<DVec2> = profile.iter().map(|&(r, z)| DVec2::new(r * radius, z)).collect();
    let x = inside.x * 0.22 * sin(seed * 137.0);
    crate::generator::shapes::lathe(&profile, 48).turned_x(90.0).at(x, 0.22 * inside.y, 0.0)
}

/// A board whose upper edge is a skyline, at `depth` in front of the back.
fn ridge(inside: DVec2, level: f64, swing: f64, phase: f64, depth: f64) -> Shape {
    let steps = 48;
    let section = |row: usize, top: f64| match row {
        0 => (-inside.y / 2.0, depth),
        1 => (top - 0.0015, depth),
        2 => (top, depth - 0.0015),
        _ => (top, 0.0),
    };
    grid((steps + 1, Ends::Open), (4, Ends::Open), |column, row| {
        let across = column as f64 / steps as f64;
        let wave = sin(360.0 * 0.9 * across + phase) + 0.5 * sin(360.0 * 2.3 * across + 2.0 * phase);
        let (y, z) = section(row, inside.y * (level - 0.5 + swing * wave));
        DVec3::new(inside.x * (across - 0.5), y, z)
    })
}

/// A wide picture in a gilt frame.
pub(crate) fn wide() -> Model {
    picture(DVec2::new(1.25, 0.95), 1.0, &GILT)
}

/// A tall one in walnut; `seed` makes its hills.
pub(crate) fn tall(seed: f64) -> Model {
    picture(DVec2::new(0.60, 0.80), seed, &WALNUT)
}
