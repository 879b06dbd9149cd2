//! Edges and points, detected by the first and second derivative of a Gaussian along both axes (the paper's section
//! 4.2).

use super::plane::{Plane, sampled};

/// The width of an edge detector in degrees, w: two standard deviations.
const WIDTH: f64 = 0.082;
/// q_f, the exponent of the feature difference.
const EXPONENT: f32 = 0.5;

/// Detectors for one viewing distance: taps along one axis and the Gaussian along the other.
pub(super) struct Detectors {
    gaussian: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Detectors {
    pub(super) fn new(pixels_per_degree: f64) -> Self {
        let deviation = WIDTH / 2.0 * pixels_per_degree;
        let radius = (3.0 * deviation).ceil() as usize;
        let gaussian = |x: f64| libm::exp(-x * x / (2.0 * deviation * deviation));
        Self {
            gaussian: balanced(&sampled(radius, gaussian)),
            edge: balanced(&sampled(radius, |x| -x * gaussian(x))),
            point: balanced(&sampled(radius, |x| (x * x / (deviation * deviation) - 1.0) * gaussian(x))),
        }
    }

    /// Radius of the detectors in pixels.
    pub(super) fn radius(&self) -> usize {
        self.gaussian.len() / 2
    }

    /// Strengths of edges and of points at each pixel of the `rows` middle rows of the channel Y.
    pub(super) fn find(&self, y: &Plane, rows: usize) -> (Plane, Plane) {
        // The paper uses luminance from 0 to 1.
        let luminance =
            Plane { width: y.width, values: y.values.iter().map(|y| (y + 16.0) / 116.0).collect() };
        let smooth = luminance.across(&self.gaussian);
        let found = |taps: &[f32]| {
            let across = luminance.across(taps).down(&self.gaussian, rows);
            across.with(&smooth.down(taps, rows), |a, b| (a * a + b * b).sqrt())
        };
        (found(&self.edge), found(&self.point))
    }
}

/// Delta E_f, 0..1, from the larger difference of the two features.
pub(super) fn error(difference: f32) -> f32 {
    (difference * std::f32::consts::FRAC_1_SQRT_2).powf(EXPONENT).min(1.0)
}

/// Taps with the positive ones scaled to the sum 1, the negative ones to -1.
fn balanced(taps: &[f64]) -> Vec<f32> {
    let above: f64 = taps.iter().filter(|tap| **tap > 0.0).sum();
    let below: f64 = -taps.iter().filter(|tap| **tap < 0.0).sum::<f64>();
    taps.iter()
        .map(|tap| (if *tap > 0.0 { tap / above } else { tap / below.max(f64::MIN_POSITIVE) }) as f32)
        .collect()
}
