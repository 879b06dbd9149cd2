//! Ten thousand balls in the spiral of a sunflower, on waves, under the sky.

use glam::DVec3;

use super::text::{Ball, array};
use crate::generator::angle::unit;
use crate::generator::noise::octaves;

const COUNT: u64 = 10_000;
/// The golden angle in degrees: consecutive balls are this far apart round the middle.
const GOLDEN_ANGLE: f64 = 137.507_764_050_037_85;
/// Distance of ball i from the middle, divided by the root of i: the density is the same everywhere.
const PACE: f64 = 0.1;
/// Materials along the arms of the spiral. Their number is a number of arms that are seen.
const ARMS: [&str; 34] = [
    "navy", "navy", "blue", "blue", "blue", "steel", "sky", "sky", "sand", "sand", "gold", "sand", "rust",
    "rust", "rust", "copper", "navy", "navy", "blue", "glass", "blue", "sky", "sky", "steel", "sand", "sand",
    "gold", "gold", "rust", "rust", "copper", "navy", "blue", "sky",
];

const HEAD: &str = "\
# Ten thousand balls in the spiral of a sunflower, under a sky with a sun. Generated: see README.md.

";

const VIEW: &str = "
[render]
width = 1024
height = 768
integrator = \"path\"
samples = 64
max_depth = 6

[camera]
position = [0.0, 5.4, 12.0]
look_at = [0.0, -0.7, 0.6]
fov = 39.0

[background]
panorama = \"sky/hazy.hdr\"
rotate = 115.0

[[plane]]
point = [0.0, -0.75, 0.0]
normal = [0.0, 1.0, 0.0]
material = \"ground\"

[material.ground]
diffuse = [0.3, 0.29, 0.27]

[material.navy]
diffuse = [0.02, 0.045, 0.14]

[material.blue]
diffuse = [0.04, 0.16, 0.42]

[material.sky]
diffuse = [0.28, 0.52, 0.68]

[material.sand]
diffuse = [0.76, 0.62, 0.4]

[material.rust]
diffuse = [0.55, 0.13, 0.04]

[material.steel]
diffuse = [0.8, 0.82, 0.85]
metallic = 1.0
roughness = 0.1

[material.gold]
diffuse = [1.0, 0.71, 0.29]
metallic = 1.0
roughness = 0.25

[material.copper]
diffuse = [0.95, 0.56, 0.4]
metallic = 1.0
roughness = 0.4

[material.glass]
diffuse = [0.0, 0.0, 0.0]
transmit = 1.0
fresnel = true
ior = 1.5
";

pub(super) fn scene() -> String {
    let balls: Vec<Ball> = (0..COUNT).map(ball).collect();
    format!("{HEAD}{}{VIEW}", array(&balls))
}

fn ball(index: u64) -> Ball {
    let from_middle = PACE * libm::sqrt(index as f64 + 0.5);
    let place = unit(GOLDEN_ANGLE * index as f64) * from_middle;
    let waves = octaves(3100, 2, DVec3::new(place.x * 0.28 + 20.0, 0.5, place.y * 0.28 + 20.0)) - 0.5;
    let size = octaves(3110, 1, DVec3::new(place.x * 0.9 + 20.0, 0.5, place.y * 0.9 + 20.0));
    Ball {
        center: DVec3::new(place.x, 1.3 * waves, place.y),
        radius: PACE * (0.55 + 0.4 * size),
        material: ARMS[index as usize % ARMS.len()].to_owned(),
    }
}
