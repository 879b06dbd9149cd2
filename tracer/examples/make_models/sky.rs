//! The sky of the scenes for the path integrator: a clear afternoon with a sun in haze, as a panorama of linear light.
//!
//! The sun is 4 degrees across, so that it covers several pixels of a small picture, and gives about twice the light of the sky.

use glam::DVec3;
use rayfarm_tracer::image::LinearImage;

use super::angle::{cos, sin};
use super::color::smooth_step;
use super::noise::octaves;
use super::{Content, GeneratedFile};

const WIDTH: u32 = 256;
const HEIGHT: u32 = 128;

/// Radiance of the sky and of what is below the horizon.
const ZENITH: DVec3 = DVec3::new(0.16, 0.30, 0.66);
const HORIZON: DVec3 = DVec3::new(0.80, 0.84, 0.90);
const GROUND: DVec3 = DVec3::new(0.20, 0.18, 0.15);
const CLOUD: DVec3 = DVec3::new(1.05, 1.02, 1.0);
const GLOW: DVec3 = DVec3::new(1.0, 0.82, 0.58);
/// Radiance of the middle of the sun: below the 1024 that paths are limited to.
const SUN: DVec3 = DVec3::new(900.0, 800.0, 640.0);
/// Azimuth (from -Z to the right) and elevation of the sun, in degrees, and the angle at which its edge fades.
const SUN_PLACE: (f64, f64) = (0.0, 40.0);
const SUN_RADIUS: (f64, f64) = (1.2, 2.6);

/// `models/sky/`.
pub(crate) fn pictures() -> Vec<GeneratedFile> {
    let content = Content::Light(picture());
    vec![GeneratedFile { path: "sky/hazy.hdr".to_owned(), content, triangles: 0 }]
}

fn picture() -> LinearImage {
    let pixel = |index: u32| {
        let (x, y) = (index % WIDTH, index / WIDTH);
        let azimuth = 360.0 * ((f64::from(x) + 0.5) / f64::from(WIDTH) - 0.5);
        let elevation = 90.0 - 180.0 * (f64::from(y) + 0.5) / f64::from(HEIGHT);
        stored(radiance(towards(azimuth, elevation)))
    };
    LinearImage { width: WIDTH, height: HEIGHT, pixels: (0..WIDTH * HEIGHT).flat_map(pixel).collect() }
}

/// Radiance from a unit direction.
fn radiance(direction: DVec3) -> DVec3 {
    let up = direction.y.max(0.0);
    let haze = 1.0 - up;
    let clear = ZENITH.lerp(HORIZON, haze * haze * haze * haze);
    let sun = towards(SUN_PLACE.0, SUN_PLACE.1);
    let from_sun = libm::acos(direction.dot(sun).clamp(-1.0, 1.0)).to_degrees();
    let over = direction / (up + 0.2);
    let banks = octaves(1500, 4, DVec3::new(over.x * 1.3 + 60.0, 0.5, over.z * 1.3 + 60.0));
    let cover = 0.75 * smooth_step(0.50, 0.72, banks) * smooth_step(0.02, 0.12, up);
    let sky = clear.lerp(CLOUD, cover) + GLOW * (0.9 * libm::exp(-from_sun / 14.0));
    let seen = GROUND.lerp(sky, smooth_step(-0.01, 0.02, direction.y));
    seen + SUN * smooth_step(SUN_RADIUS.1, SUN_RADIUS.0, from_sun)
}

/// The nearest colour that Radiance HDR stores: 8 bits of each channel with the exponent of the largest one, not rounded up to a
/// larger exponent.
fn stored(color: DVec3) -> [f32; 3] {
    // A channel from 2^(e - 1) to 2^e has the exponent e, and steps of 2^(e - 8).
    let (_, exponent) = libm::frexp(color.max_element());
    let step = libm::ldexp(1.0, exponent - 8);
    color.to_array().map(|channel| ((channel / step).floor() * step) as f32)
}

fn towards(azimuth: f64, elevation: f64) -> DVec3 {
    DVec3::new(sin(azimuth) * cos(elevation), sin(elevation), -cos(azimuth) * cos(elevation))
}
