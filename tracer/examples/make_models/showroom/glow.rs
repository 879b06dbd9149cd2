//! The light of a card behind the perfume: bright in the middle, and less towards the edges.

use glam::{DVec2, DVec3};
use rayfarm_tracer::image::RgbImage;

use crate::generator::color::{smooth_step, srgb};

const SIDE: u32 = 64;
/// Linear colours of the middle and of the edge.
const MIDDLE: DVec3 = DVec3::new(1.0, 0.90, 0.72);
const EDGE: DVec3 = DVec3::new(0.16, 0.10, 0.055);

pub(super) fn picture() -> RgbImage {
    let mut picture = RgbImage::new(SIDE, SIDE);
    for (i, pixel) in picture.pixels.chunks_exact_mut(3).enumerate() {
        let place = DVec2::new(f64::from(i as u32 % SIDE) + 0.5, f64::from(i as u32 / SIDE) + 0.5);
        // The middle is a little below that of the card.
        let from_middle = (place / f64::from(SIDE) - DVec2::new(0.5, 0.6)).length();
        pixel.copy_from_slice(&srgb(MIDDLE.lerp(EDGE, smooth_step(0.0, 0.62, from_middle))));
    }
    picture
}
