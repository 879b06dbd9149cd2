//! A cement tile with an ornament, the same in all four quarters, so that tiles side by side make circles.

use rayfarm_tracer::image::RgbImage;

const SIDE: u32 = 64;
/// sRGB.
const CREAM: [u8; 3] = [226, 214, 190];
const SLATE: [u8; 3] = [74, 92, 108];
const CLAY: [u8; 3] = [168, 92, 62];
const JOINT: [u8; 3] = [134, 126, 116];

pub(super) fn picture() -> RgbImage {
    let mut picture = RgbImage::new(SIDE, SIDE);
    for (i, pixel) in picture.pixels.chunks_exact_mut(3).enumerate() {
        pixel.copy_from_slice(&color(i as u32 % SIDE, i as u32 / SIDE));
    }
    picture
}

fn color(x: u32, y: u32) -> [u8; 3] {
    // From the corner of the tile to its middle, 0 to 1.
    let [x, y] = [x, y].map(|c| (f64::from(c.min(SIDE - 1 - c)) + 0.5) * 2.0 / f64::from(SIDE));
    if x.min(y) < 0.04 {
        return JOINT;
    }
    let to_corner = x * x + y * y;
    let to_middle = (1.0 - x) * (1.0 - x) + (1.0 - y) * (1.0 - y);
    if to_corner < 0.09 || (0.36..0.49).contains(&to_corner) {
        CLAY
    } else if to_middle < 0.16 && (1.0 - x).min(1.0 - y) > 0.06 || (0.25..0.3).contains(&to_middle) {
        SLATE
    } else {
        CREAM
    }
}
