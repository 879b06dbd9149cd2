//! Lambert's term.

use glam::Vec3;

/// c_d N.L, for N.L above zero.
pub(super) fn diffuse(color: Vec3, n_dot_l: f32) -> Vec3 {
    color * n_dot_l
}
