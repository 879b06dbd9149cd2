//! Directions around a normal.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::super::extent::concentric;

/// A point of the unit disk from a point of the unit square.
pub(super) fn on_disk(at: DVec2) -> DVec2 {
    concentric(2.0 * at.x - 1.0, 2.0 * at.y - 1.0)
}

/// The vector with these coordinates in the frame of a unit normal n (Duff et al., "Building an Orthonormal Basis, Revisited", 2017): its
/// first two axes are (1 - n_x^2 / (1 + n_z), -n_x n_y / (1 + n_z), -n_x) and (-n_x n_y / (1 + n_z), 1 - n_y^2 / (1 + n_z), -n_y) for n_z
/// from 0 up, and by symmetry about z = 0 below.
pub(super) fn around(n: DVec3, local: DVec3) -> DVec3 {
    let side = if n.z < 0.0 { -1.0 } else { 1.0 };
    let over = 1.0 / (1.0 + n.z.abs());
    let shared = -n.x * n.y * over * side;
    let across = DVec3::new(1.0 - n.x * n.x * over, shared * side, -n.x * side);
    let along = DVec3::new(shared, side - n.y * n.y * over * side, -n.y);
    across * local.x + along * local.y + n * local.z
}

/// A direction with the density of [`cosine_density`], from a point of the unit square (Malley's method).
pub(super) fn cosine_direction(n: DVec3, at: DVec2) -> DVec3 {
    let point = on_disk(at);
    let height = (1.0 - point.length_squared()).max(0.0).sqrt();
    around(n, point.extend(height)).normalize()
}

/// cos / pi, and 0 below the surface.
pub(super) fn cosine_density(n: DVec3, direction: DVec3) -> f64 {
    n.dot(direction).max(0.0) / PI
}

/// A direction in the cone of a half angle, given by its cosine, around an axis; uniform over solid angle.
pub(super) fn in_cone(axis: DVec3, least_cosine: f64, at: DVec2) -> DVec3 {
    let cosine = 1.0 - at.x * (1.0 - least_cosine);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (s, c) = libm::sincos(2.0 * PI * at.y);
    around(axis, DVec3::new(sine * c, sine * s, cosine)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for i in 0..200 {
            let n = in_cone(DVec3::Z, -1.0, DVec2::new((f64::from(i) + 0.5) / 200.0, f64::from(i) * 0.618));
            let [x, y, z] = DVec3::AXES.map(|axis| around(n, axis));
            assert!((x.cross(y) - z).length() < 1e-14 && (z - n).length() < 1e-15, "{n}");
            assert!(x.dot(y).abs() < 1e-14 && (x.length() - 1.0).abs() < 1e-14);
        }
    }
}
