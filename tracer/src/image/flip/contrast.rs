//! Contrast sensitivity: each channel is filtered by that of the eye, as Gaussians over degrees (the paper's table 1:
//! a1, b1, a2, b2 of the achromatic, the red-green and the blue-yellow channel).

use std::f64::consts::PI;

use super::plane::{Plane, sampled};

/// b of the single Gaussians of Y and of Cx.
const ACHROMATIC: f64 = 0.0047;
const RED_GREEN: f64 = 0.0053;
/// a and b of the two Gaussians of Cz.
const BLUE_YELLOW: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];

/// The filters of the three channels. A Gaussian in two dimensions is separable: one pass across, one down.
pub(super) struct Contrast {
    y: Vec<f32>,
    cx: Vec<f32>,
    /// Each Gaussian with its share in the whole.
    cz: [(f32, Vec<f32>); 2],
}

impl Contrast {
    pub(super) fn new(pixels_per_degree: f64) -> Self {
        // Three standard deviations of the widest one, for all of them.
        let (_, widest) = BLUE_YELLOW[0];
        let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
        let gaussian = |b: f64| {
            sampled(radius, |x| libm::exp(-PI * PI * (x / pixels_per_degree) * (x / pixels_per_degree) / b))
        };
        // Integral of a two-dimensional Gaussian before the sum is normalised.
        let weight = |(a, b): (f64, f64)| a * (PI / b).sqrt() * gaussian(b).iter().sum::<f64>().powi(2);
        let whole: f64 = BLUE_YELLOW.map(weight).iter().sum();
        Self {
            y: normalized(&gaussian(ACHROMATIC)),
            cx: normalized(&gaussian(RED_GREEN)),
            cz: BLUE_YELLOW.map(|(a, b)| ((weight((a, b)) / whole) as f32, normalized(&gaussian(b)))),
        }
    }

    /// Radius of the filters in pixels.
    pub(super) fn radius(&self) -> usize {
        self.y.len() / 2
    }

    /// The filtered channels Y, Cx and Cz of the `rows` middle rows.
    pub(super) fn filter(&self, [y, cx, cz]: [&Plane; 3], rows: usize) -> [Plane; 3] {
        let blurred = |plane: &Plane, taps: &[f32]| plane.across(taps).down(taps, rows);
        let [(first, wide), (second, narrow)] = &self.cz;
        let cz = blurred(cz, wide).with(&blurred(cz, narrow), |a, b| first * a + second * b);
        [blurred(y, &self.y), blurred(cx, &self.cx), cz]
    }
}

/// Taps scaled to the sum 1.
fn normalized(taps: &[f64]) -> Vec<f32> {
    let sum: f64 = taps.iter().sum();
    taps.iter().map(|tap| (tap / sum) as f32).collect()
}
