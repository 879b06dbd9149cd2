//! FLIP: the visible difference of two pictures that are shown alternately (LDR-FLIP of Andersson, Nilsson,
//! Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating Images", HPG 2020).
//!
//! For each pixel: details below the visible contrast are filtered out ([`contrast`]), the remaining difference of
//! colours is computed ([`color`]) and amplified where an edge or a point is in one picture only ([`features`]). All
//! steps are local, so pictures are processed in strips of rows, with margins of the filters' radius.

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

/// Pixels per degree of a monitor 3840 pixels and 0.7 m wide, seen from 0.7 m away: the value of the paper's authors.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;

/// Range of [`flip`]: below it, no filter is wider than a pixel; above it, a pixel is a hundredth of the resolution
/// of the eye.
const KNOWN_PIXELS_PER_DEGREE: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Rows per strip; with the filters' margins they fit into the cache.
const STRIP_ROWS: usize = 64;

/// The error of each pixel of `test` compared with `reference`, 0..1, as seen at `pixels_per_degree`
/// ([`PIXELS_PER_DEGREE`] for a monitor on a desk). The measure is symmetric.
///
/// # Errors
/// Pictures of different sizes, or whose buffers do not match their sizes; pixels per degree outside of 1 to 1000.
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

/// An observer at a distance from the monitor: the filters and the colour space.
struct Observer {
    space: ColorSpace,
    contrast: Contrast,
    detectors: Detectors,
    color_error: ColorError,
}

/// Filtered rows of one picture.
struct Seen {
    /// Hunt-adjusted L*a*b* without invisible contrast.
    colors: Vec<Vec3>,
    /// Strength of an edge at each pixel.
    edges: Plane,
    /// Strength of a point at each pixel.
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

    /// The errors of the rows from `first` on, as many as `out` has.
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

    /// The channels Y, Cx and Cz of `rows` rows with `margin` more on both sides; outside of the picture its
    /// outermost rows repeat.
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
