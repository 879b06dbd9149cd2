//! FLIP: how much two pictures differ to somebody who flips between them (LDR-FLIP of Andersson, Nilsson, Akenine-Möller,
//! Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating Images", HPG 2020).
//!
//! For each pixel: what the eye cannot see at that distance is filtered off ([`contrast`]), what is left is a difference of
//! colours ([`color`]), and it counts more where an edge or a point is in one picture only ([`features`]). All of this is
//! local, so pictures are cut into strips of rows, with as many rows around each as the filters reach.

mod color;
mod contrast;
mod features;
mod map;
mod plane;
#[cfg(test)]
mod tests;

use glam::Vec3;
use rayon::prelude::*;

use self::color::{ColorError, ColorSpace};
use self::contrast::Contrast;
use self::features::Detectors;
use self::plane::Plane;
use super::{ImageError, RgbImage};

pub use map::FlipMap;

/// Of a monitor 3840 pixels and 0.7 m wide, seen from 0.7 m away: what the paper's authors take.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;

/// What [`flip`] knows: below the first, no filter is wider than a pixel; above the second, a pixel is a hundredth of what the
/// sharpest eye tells apart.
const KNOWN_PIXELS_PER_DEGREE: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Rows that are worked on together; their filters' margins fit into the cache with them.
const STRIP_ROWS: usize = 64;

/// The error of each pixel of `test` against `reference`, 0..1, as seen from where `pixels_per_degree` pixels are one degree
/// ([`PIXELS_PER_DEGREE`] for a monitor on a desk). It does not matter which of the two is which.
///
/// # Errors
/// Pictures of different sizes, or whose buffers do not fit their sizes; pixels per degree that are not from 1 to 1000.
pub fn flip(reference: &RgbImage, test: &RgbImage, pixels_per_degree: f64) -> Result<FlipMap, ImageError> {
    reference.check_against(test)?;
    if !KNOWN_PIXELS_PER_DEGREE.contains(&pixels_per_degree) {
        return Err(ImageError::PixelsPerDegree { given: pixels_per_degree });
    }
    let (width, height) = (reference.width as usize, reference.height as usize);
    let mut errors = vec![0.0; width * height];
    let observer = Observer::new(pixels_per_degree);
    errors.par_chunks_mut((STRIP_ROWS * width).max(1)).enumerate().for_each(|(strip, out)| {
        observer.compare(reference, test, strip * STRIP_ROWS, out);
    });
    Ok(FlipMap { width: reference.width, height: reference.height, errors })
}

/// Somebody before a monitor.
struct Observer {
    space: ColorSpace,
    contrast: Contrast,
    detectors: Detectors,
    color_error: ColorError,
}

/// What is seen of some pixels of one picture.
struct Seen {
    /// Without what is too fine to be seen, in Hunt-adjusted L*a*b*.
    colors: Vec<Vec3>,
    /// How much of an edge each pixel is.
    edges: Plane,
    /// How much of a point each pixel is.
    points: Plane,
}

impl Observer {
    fn new(pixels_per_degree: f64) -> Self {
        let space = ColorSpace::new();
        Self {
            color_error: ColorError::new(&space),
            contrast: Contrast::new(pixels_per_degree),
            detectors: Detectors::new(pixels_per_degree),
            space,
        }
    }

    /// The errors of the rows from `first` on, as many as `out` holds.
    fn compare(&self, reference: &RgbImage, test: &RgbImage, first: usize, out: &mut [f32]) {
        let rows = out.len() / reference.width as usize;
        let (a, b) = (self.look(reference, first, rows), self.look(test, first, rows));
        for (i, out) in out.iter_mut().enumerate() {
            let edge = (a.edges.values[i] - b.edges.values[i]).abs();
            let point = (a.points.values[i] - b.points.values[i]).abs();
            let color = self.color_error.of(a.colors[i], b.colors[i]);
            *out = color.powf(1.0 - features::error(edge.max(point)));
        }
    }

    fn look(&self, picture: &RgbImage, first: usize, rows: usize) -> Seen {
        let margin = self.contrast.radius().max(self.detectors.radius());
        let [y, cx, cz] = self.opponent(picture, first, rows, margin);
        let (edges, points) = self.detectors.find(&y, rows);
        let [y, cx, cz] = self.contrast.filter([&y, &cx, &cz], rows);
        let color = |i: usize| self.space.seen(Vec3::new(y.values[i], cx.values[i], cz.values[i]));
        Seen { colors: (0..y.values.len()).map(color).collect(), edges, points }
    }

    /// The channels Y, Cx and Cz of `rows` rows with `margin` more on both sides; beyond the picture, its outermost rows go on.
    fn opponent(&self, picture: &RgbImage, first: usize, rows: usize, margin: usize) -> [Plane; 3] {
        let (width, height) = (picture.width as usize, picture.height as usize);
        let mut planes = [(); 3].map(|()| Plane::with_capacity(width, rows + 2 * margin));
        for row in first..first + rows + 2 * margin {
            let row = row.saturating_sub(margin).min(height - 1);
            for rgb in picture.pixels[3 * width * row..3 * width * (row + 1)].chunks_exact(3) {
                let color = self.space.opponent([rgb[0], rgb[1], rgb[2]]);
                for (plane, value) in planes.iter_mut().zip(color.to_array()) {
                    plane.values.push(value);
                }
            }
        }
        planes
    }
}
