//! The view from the window: a sea with headlands under a morning sky, as a panorama. Only the half of it that the
//! window faces (-Z) has clouds and land; the rest is behind walls.

use glam::DVec3;
use rayfarm_tracer::image::RgbImage;

use crate::generator::angle::{cos, sin};
use crate::generator::color::{smooth_step, srgb};
use crate::generator::noise::octaves;

const WIDTH: u32 = 1024;
const HEIGHT: u32 = 512;

/// Linear colours.
const ZENITH: DVec3 = DVec3::new(0.12, 0.29, 0.62);
const HORIZON: DVec3 = DVec3::new(0.98, 0.86, 0.70);
const GLOW: DVec3 = DVec3::new(1.0, 0.72, 0.42);
const CLOUD: DVec3 = DVec3::new(0.98, 0.93, 0.88);
const SEA_FAR: DVec3 = DVec3::new(0.20, 0.39, 0.52);
const SEA_NEAR: DVec3 = DVec3::new(0.012, 0.105, 0.175);

/// The direction to the sun, as the scene file has it, not of unit length.
const SUN: DVec3 = DVec3::new(-0.52, 0.61, -0.60);

/// Headlands: azimuth of the middle and half the width in degrees, height in degrees, colour.
const LAND: [(f64, f64, f64, DVec3); 3] = [
    (-13.0, 17.0, 2.6, DVec3::new(0.36, 0.44, 0.54)),
    (20.0, 19.0, 3.4, DVec3::new(0.20, 0.28, 0.36)),
    (36.0, 18.0, 5.0, DVec3::new(0.08, 0.14, 0.15)),
];

pub(super) fn picture() -> RgbImage {
    let mut picture = RgbImage::new(WIDTH, HEIGHT);
    for (i, pixel) in picture.pixels.chunks_exact_mut(3).enumerate() {
        let (x, y) = (i as u32 % WIDTH, i as u32 / WIDTH);
        let azimuth = 360.0 * ((f64::from(x) + 0.5) / f64::from(WIDTH) - 0.5);
        let elevation = 90.0 - 180.0 * (f64::from(y) + 0.5) / f64::from(HEIGHT);
        pixel.copy_from_slice(&srgb(color(azimuth, elevation)));
    }
    picture
}

/// Linear colour of a direction: azimuth from -Z to the right, and elevation, in degrees.
fn color(azimuth: f64, elevation: f64) -> DVec3 {
    // Clouds, waves and land fade towards the walls.
    let ahead = smooth_step(105.0, 75.0, azimuth.abs());
    if elevation < -30.0 {
        return SEA_NEAR;
    }
    let sky = sky(azimuth, elevation.max(0.0), ahead);
    let sea = sea(azimuth, elevation.min(0.0), ahead);
    let open = sea.lerp(sky, smooth_step(-0.25, 0.25, elevation));
    LAND.iter().zip(0..).fold(open, |behind, (&(middle, half, height, color), index)| {
        let place = (azimuth - middle) / half;
        let rough = octaves(1700 + 10 * index, 4, DVec3::new(azimuth * 0.22 + 40.0, 0.5, 0.5));
        let top = height * (1.0 - place * place).max(0.0) * (0.45 + 1.1 * rough);
        let covered = smooth_step(top + 0.35, top - 0.35, elevation) * smooth_step(-0.4, 0.1, elevation);
        // Mist at the foot.
        let shade = color.lerp(SEA_FAR, 0.45 * smooth_step(2.5, 0.0, elevation));
        behind.lerp(shade, covered * ahead * smooth_step(0.0, 0.3, top))
    })
}

fn sky(azimuth: f64, elevation: f64, ahead: f64) -> DVec3 {
    let direction = towards(azimuth, elevation);
    let haze = 1.0 - direction.y;
    let clear = ZENITH.lerp(HORIZON, haze * haze * haze * haze * haze * haze);
    let from_sun = libm::acos(direction.dot(SUN.normalize()).clamp(-1.0, 1.0)).to_degrees();
    let lit = clear + GLOW * (0.55 * libm::exp(-from_sun / 16.0));
    let over = direction / (direction.y + 0.16);
    let banks = octaves(1800, 5, DVec3::new(over.x * 1.1 + 9.0, over.z * 2.4 + 30.0, 0.3));
    let cover = smooth_step(0.50, 0.74, banks) * smooth_step(0.5, 4.0, elevation) * ahead;
    let bright = CLOUD * (0.80 + 0.25 * smooth_step(0.55, 0.8, banks));
    lit.lerp(bright, 0.9 * cover)
}

fn sea(azimuth: f64, elevation: f64, ahead: f64) -> DVec3 {
    let down = -elevation;
    let calm = SEA_FAR.lerp(SEA_NEAR, smooth_step(0.0, 13.0, down).sqrt());
    let swell = octaves(1900, 3, DVec3::new(azimuth * 0.35 + 50.0, 46.0 / (down + 1.6), 0.7)) - 0.5;
    let glitter = libm::exp(-(azimuth + 40.0) * (azimuth + 40.0) / 500.0) * (0.25 + 0.5 * swell.max(0.0));
    calm * (1.0 + 0.38 * swell * ahead) + GLOW * (0.5 * glitter * smooth_step(14.0, 0.0, down))
}

fn towards(azimuth: f64, elevation: f64) -> DVec3 {
    DVec3::new(sin(azimuth) * cos(elevation), sin(elevation), -cos(azimuth) * cos(elevation))
}
