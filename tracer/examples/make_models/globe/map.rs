//! A map of a world that is nowhere: noise for heights, a few colours for heights, a line every 30 degrees.

use glam::DVec3;
use rayfarm_tracer::image::RgbImage;

use crate::generator::angle::{cos, heading, sin};
use crate::generator::noise::noise;

const WIDTH: u32 = 512;
const HEIGHT: u32 = 256;

/// From the sea's bottom to the mountains: up to this height, this colour (sRGB).
const COLORS: [(f64, [u8; 3]); 9] = [
    (0.40, [30, 62, 104]),
    (0.47, [41, 82, 128]),
    (0.515, [66, 116, 152]),
    (0.53, [112, 160, 178]),
    (0.542, [222, 204, 160]),
    (0.59, [142, 158, 92]),
    (0.65, [98, 126, 74]),
    (0.71, [150, 118, 82]),
    (1.0, [236, 230, 220]),
];
const ICE: [u8; 3] = [240, 242, 244];
const LINE: [u8; 3] = [60, 48, 40];

pub(super) fn picture() -> RgbImage {
    let mut picture = RgbImage::new(WIDTH, HEIGHT);
    for (i, pixel) in picture.pixels.chunks_exact_mut(3).enumerate() {
        let (x, y) = (i as u32 % WIDTH, i as u32 / WIDTH);
        pixel.copy_from_slice(&color(x, y));
    }
    picture
}

fn color(x: u32, y: u32) -> [u8; 3] {
    let longitude = 360.0 * (f64::from(x) + 0.5) / f64::from(WIDTH);
    let latitude = 90.0 - 180.0 * (f64::from(y) + 0.5) / f64::from(HEIGHT);
    let place = heading(longitude) * cos(latitude) + DVec3::Y * sin(latitude);
    let height = (0..6).map(|octave: u32| {
        noise(900 + u64::from(octave), place * f64::from(1 << octave) * 1.7) / f64::from(2 << octave)
    });
    let height: f64 = height.sum();
    let pixel_degrees = 360.0 / f64::from(WIDTH);
    let is_line = |degrees: f64| degrees.rem_euclid(30.0) < pixel_degrees;
    if is_line(longitude) || is_line(latitude) {
        return LINE;
    }
    if latitude.abs() > 74.0 + 30.0 * (height - 0.5) {
        return ICE;
    }
    COLORS.iter().find(|(top, _)| height < *top).map_or(COLORS[8].1, |(_, color)| *color)
}
