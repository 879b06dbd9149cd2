//! The error of each pixel, as numbers and as a picture.

use super::super::RgbImage;

/// The error of each pixel, from 0 (invisible) to 1 (green compared with blue).
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` errors, row by row from the top.
    pub errors: Vec<f32>,
}

/// Colours from no error to the largest, in equal steps: black, violet, red, orange, pale yellow. Lightness increases
/// monotonically, so the order is visible in grey and to colour-blind viewers.
const COLORS: [[f32; 3]; 6] = [
    [0.0, 0.0, 0.0],
    [52.0, 16.0, 104.0],
    [128.0, 34.0, 124.0],
    [210.0, 62.0, 96.0],
    [250.0, 146.0, 86.0],
    [255.0, 250.0, 196.0],
];

impl FlipMap {
    /// Mean over all pixels; 0 for an empty picture.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.errors.iter().copied().map(f64::from).sum();
        sum / self.errors.len().max(1) as f64
    }

    /// The map as a picture: black for no error, lighter for larger errors.
    pub fn picture(&self) -> RgbImage {
        RgbImage {
            width: self.width,
            height: self.height,
            pixels: self.errors.iter().flat_map(|error| color(*error)).collect(),
        }
    }
}

fn color(error: f32) -> [u8; 3] {
    let place = error.clamp(0.0, 1.0) * (COLORS.len() - 1) as f32;
    let below = (place as usize).min(COLORS.len() - 2);
    let share = place - below as f32;
    std::array::from_fn(|i| (COLORS[below][i] * (1.0 - share) + COLORS[below + 1][i] * share).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_errors_are_lighter() {
        let luma = |error: f32| {
            let [r, g, b] = color(error).map(f32::from);
            0.299 * r + 0.587 * g + 0.114 * b
        };
        assert_eq!((color(0.0), color(-1.0)), ([0; 3], [0; 3]));
        assert_eq!((color(1.0), color(9.0)), ([255, 250, 196], [255, 250, 196]));
        for step in 0..50 {
            let (low, high) = (luma(step as f32 / 50.0), luma((step + 1) as f32 / 50.0));
            assert!(low + 1.0 < high, "{step}: {low} {high}");
        }
    }

    #[test]
    fn the_mean_covers_all_pixels_and_the_picture_shows_each() {
        let map = FlipMap { width: 2, height: 2, errors: vec![0.0, 1.0, 0.5, 0.5] };
        assert_eq!(map.mean(), 0.5);
        let picture = map.picture();
        assert_eq!((picture.pixel(0, 0), picture.pixel(1, 0)), (Some([0; 3]), Some([255, 250, 196])));
        assert_eq!(picture.pixel(0, 1), picture.pixel(1, 1));
        assert_eq!(FlipMap { width: 0, height: 0, errors: Vec::new() }.mean(), 0.0);
    }
}
