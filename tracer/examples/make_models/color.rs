//! Colours of generated pictures: computed in linear light, written as sRGB bytes.

use glam::DVec3;

/// The sRGB bytes of a linear colour; values above 1 are cut off.
pub(crate) fn srgb(linear: DVec3) -> [u8; 3] {
    linear.to_array().map(|value| {
        let value = value.clamp(0.0, 1.0);
        let encoded =
            if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * libm::pow(value, 1.0 / 2.4) - 0.055 };
        (encoded * 255.0).round() as u8
    })
}

/// From 0 at `low` to 1 at `high`, level at both ends.
pub(crate) fn smooth_step(low: f64, high: f64, value: f64) -> f64 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
