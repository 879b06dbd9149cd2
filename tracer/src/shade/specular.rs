//! The highlight: Blinn's half vector, Phong's exponent.

use glam::Vec3;

use crate::scene::Material;

/// c_s max(0, N.H)^p_r with H = (L + V) / |L + V|.
///
/// `libm::pow` is the same code on every platform. In `f64`, because an exponent of 10^6 multiplies the relative error
/// of N.H by as much.
pub(super) fn specular(material: &Material, normal: Vec3, to_light: Vec3, to_viewer: Vec3) -> Vec3 {
    let half = to_light.as_dvec3() + to_viewer.as_dvec3();
    let n_dot_h = normal.as_dvec3().dot(half) / half.length();
    if !(n_dot_h > 0.0) {
        // Only an exponent of zero makes something of nothing: x^0 = 1.
        return if material.exponent == 0.0 { material.specular } else { Vec3::ZERO };
    }
    material.specular * libm::pow(n_dot_h.min(1.0), f64::from(material.exponent)) as f32
}
