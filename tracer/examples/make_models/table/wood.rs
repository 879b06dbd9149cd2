//! The wood of a plank, its grain along u. It has no seam where it is repeated as a mirror image.

use glam::DVec3;
use rayfarm_tracer::image::RgbImage;

use crate::generator::color::{smooth_step, srgb};
use crate::generator::noise::{noise, octaves};

const WIDTH: u32 = 512;
const HEIGHT: u32 = 128;

/// Linear colours of early and late wood.
const EARLY: DVec3 = DVec3::new(0.300, 0.165, 0.082);
const LATE: DVec3 = DVec3::new(0.130, 0.062, 0.029);

pub(super) fn picture() -> RgbImage {
    let mut picture = RgbImage::new(WIDTH, HEIGHT);
    for (i, pixel) in picture.pixels.chunks_exact_mut(3).enumerate() {
        let (x, y) = (i as u32 % WIDTH, i as u32 / WIDTH);
        let [u, v] = [x, y].map(|c| (f64::from(c) + 0.5) / f64::from(HEIGHT));
        pixel.copy_from_slice(&srgb(color(u, v)));
    }
    picture
}

/// A plank cut off the middle of the trunk: rings become long arches. `v` from 0 to 1 across, `u` in the same unit.
fn color(u: f64, v: f64) -> DVec3 {
    let bend = octaves(2100, 3, DVec3::new(u * 0.55, v * 1.3, 0.4)) - 0.5;
    let across = v - 0.42 + 0.55 * bend;
    let rings = 9.0 * libm::sqrt(across * across + 0.03 * (u - 1.6) * (u - 1.6) + 0.02) + 1.2 * bend;
    let ring = rings - rings.floor();
    let late = smooth_step(0.35, 0.92, ring) * smooth_step(1.0, 0.93, ring);
    let fibre = noise(2200, DVec3::new(u * 5.0, v * 60.0, 0.5)) - 0.5;
    let pores = smooth_step(0.72, 0.90, noise(2300, DVec3::new(u * 9.0, v * 48.0, 0.5)));
    let tone = (0.62 * late + 0.30 * fibre + 0.12 * bend + 0.16).clamp(0.0, 1.0);
    EARLY.lerp(LATE, tone) * (1.0 - 0.28 * pores)
}
