//! Weights of the taps of the filter: 1 within a surface of even light, 0 across edges.
//!
//! ```text
//! w = bump(|l_p - l_q|^2 / (16 (v_p + v_q)))                    light, v its variance
//!     max(0, n_p . n_q)^64                                      normals
//!     bump((z_q - z_p - s_p . d)^2 / (s / 2 + z_p / 128)^2)     depth, s_p its slope, d the columns and rows to q, s = |s_x d_x| + |s_y d_y|
//! bump(x) = max(0, 1 - x)^2
//! ```
//!
//! bump is Tukey's biweight: unlike exp(-x) it needs no function of the system's library, and is 0 far away.

use super::estimate::Estimate;
use super::guides::Guide;

/// Squared difference of light, in parts of its variance, from which a tap does not count.
const NOISE: f32 = 16.0;

/// Least squared tolerance of light.
const LEAST_TOLERANCE: f32 = 1e-12;

/// Tolerance of the depth in parts of the slope, and in parts of the depth.
const OF_SLOPE: f32 = 0.5;
const OF_DEPTH: f32 = 1.0 / 128.0;

/// Weight of a tap by its surface; `pixels` are the columns and rows from the pixel to the tap.
#[inline(always)]
pub(super) fn of_surface(own: &Guide, tap: &Guide, pixels: [f32; 2]) -> f32 {
    match (own.depth.is_finite(), tap.depth.is_finite()) {
        (true, true) => {}
        // Background.
        (false, false) => return 1.0,
        _ => return 0.0,
    }
    let cosine =
        own.normal[0] * tap.normal[0] + own.normal[1] * tap.normal[1] + own.normal[2] * tap.normal[2];
    // Comparisons with NaN are false.
    let mut of_normal = if cosine > 0.0 { cosine.min(1.0) } else { return 0.0 };
    for _ in 0..6 {
        of_normal *= of_normal;
    }
    let [across, along] = [own.slope[0] * pixels[0], own.slope[1] * pixels[1]];
    let tolerance = OF_SLOPE * (across.abs() + along.abs()) + OF_DEPTH * own.depth + f32::MIN_POSITIVE;
    let difference = (tap.depth - own.depth - (across + along)) / tolerance;
    of_normal * bump(difference * difference)
}

/// Weight of a tap by its light.
#[inline(always)]
pub(super) fn of_light(own: &Estimate, tap: &Estimate) -> f32 {
    let [r, g, b] = [0, 1, 2].map(|channel| own.light[channel] - tap.light[channel]);
    let squared = (r * r + g * g + b * b) / 3.0;
    bump(squared / (NOISE * (own.variance + tap.variance) + LEAST_TOLERANCE))
}

/// Tukey's biweight of a squared distance; 0 for NaN.
#[inline(always)]
fn bump(squared: f32) -> f32 {
    let height = 1.0 - squared;
    if height > 0.0 { height * height } else { 0.0 }
}
