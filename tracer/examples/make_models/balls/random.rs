//! About 500 small balls round three large ones, of colours, metals and glass, seen through a lens.

use glam::{DVec2, DVec3};

use super::text::{Ball, array, list, number};
use crate::generator::random::{between, pick, uniform};

/// Cells along a side of the square of small balls, each a unit wide.
const CELLS: u64 = 23;
/// The width of the part of a cell in which centres are: balls of different cells do not overlap.
const SPREAD: f64 = 1.0 - 2.0 * SMALL;
const SMALL: f64 = 0.2;
/// The large balls: centre, radius, material.
const LARGE: [(DVec3, f64, &str); 3] = [
    (DVec3::new(-4.0, 1.0, 0.0), 1.0, "clay"),
    (DVec3::new(0.0, 1.0, 0.0), 1.0, "glass"),
    (DVec3::new(4.0, 1.0, 0.0), 1.0, "bronze"),
];
const PAINTS: u64 = 24;
const METALS: u64 = 8;

const HEAD: &str = "\
# About 500 balls at random, of colours, metals and glass: a lens blurs what is near and far.
# Generated: see README.md.

";

const VIEW: &str = "
[render]
width = 1200
height = 675
integrator = \"path\"
samples = 256
max_depth = 12

[camera]
position = [12.5, 2.1, 3.6]
look_at = [0.9, 0.75, 0.15]
fov = 21.0
aperture = 0.06
focus_distance = 9.2

[background]
gradient = { bottom = [1.0, 0.98, 0.95], top = [0.38, 0.6, 1.0] }

[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
material = \"ground\"

[material.ground]
diffuse = [0.46, 0.46, 0.44]

[material.glass]
diffuse = [0.0, 0.0, 0.0]
transmit = 1.0
fresnel = true
ior = 1.5

[material.clay]
diffuse = [0.42, 0.19, 0.1]

[material.bronze]
diffuse = [0.72, 0.6, 0.48]
metallic = 1.0
roughness = 0.0
";

pub(super) fn scene() -> String {
    let large =
        LARGE.map(|(center, radius, material)| Ball { center, radius, material: material.to_owned() });
    let balls: Vec<Ball> = large.into_iter().chain((0..CELLS * CELLS).filter_map(small)).collect();
    let materials: String = (0..PAINTS).map(paint).chain((0..METALS).map(metal)).collect();
    format!("{HEAD}{}{VIEW}{materials}", array(&balls))
}

/// The ball of a cell, or none where a large ball is.
fn small(cell: u64) -> Option<Ball> {
    let corner = DVec2::new((cell % CELLS) as f64, (cell / CELLS) as f64) - CELLS as f64 / 2.0;
    let place = corner + DVec2::new(uniform(3000, cell), uniform(3001, cell)) * SPREAD;
    let center = DVec3::new(place.x, SMALL, place.y);
    if LARGE.iter().any(|(large, radius, _)| center.distance(*large) < radius + SMALL) {
        return None;
    }
    let material = match uniform(3002, cell) {
        kind if kind < 0.66 => format!("paint_{}", (uniform(3003, cell) * PAINTS as f64) as u64),
        kind if kind < 0.86 => format!("metal_{}", (uniform(3003, cell) * METALS as f64) as u64),
        _ => "glass".to_owned(),
    };
    Some(Ball { center, radius: SMALL, material })
}

/// A diffuse material. The product of two numbers makes dark, saturated colours more frequent than pale ones.
fn paint(index: u64) -> String {
    let channel = |kind| 0.04 + 0.86 * uniform(kind, index) * uniform(kind + 1, index);
    let color = [channel(3010), channel(3012), channel(3014)];
    format!("\n[material.paint_{index}]\ndiffuse = {}\n", list(color))
}

/// A metal, from a mirror to a rough one.
fn metal(index: u64) -> String {
    let color = [3020, 3021, 3022].map(|kind| between(kind, index, 0.5, 0.95));
    let roughness = pick(3023, index, &[0.0, 0.15, 0.3, 0.45]);
    format!(
        "\n[material.metal_{index}]\ndiffuse = {}\nmetallic = 1.0\nroughness = {}\n",
        list(color),
        number(roughness)
    )
}
