//! Smooth surfaces: the law of reflection, Snell's law, Fresnel's equations.
//!
//! D is the unit direction of a ray, N the unit normal on its side, n_1 and n_2 are the indices of refraction on the near and the
//! far side.

use glam::DVec3;

/// The direction with the same component along a surface as D, and the opposite one across it.
pub(super) fn mirrored(direction: DVec3, normal: DVec3) -> DVec3 {
    let across = normal * direction.dot(normal);
    (direction - across) - across
}

/// Snell's law, n_1 sin(theta_1) = n_2 sin(theta_2): the component along the surface is multiplied by n_1 / n_2. `None` for total
/// internal reflection.
pub(super) fn bent(direction: DVec3, normal: DVec3, [near, far]: [f64; 2]) -> Option<DVec3> {
    let along = (direction - normal * direction.dot(normal)) * (near / far);
    let square = 1.0 - along.length_squared();
    (square >= 0.0).then(|| along - normal * square.sqrt())
}

/// Fresnel's equations: the share of unpolarised light that is reflected. 1 for total internal reflection, and for rays along the
/// surface or from below it.
pub(super) fn reflected_share(direction: DVec3, normal: DVec3, [near, far]: [f64; 2]) -> f64 {
    let cosine = -direction.dot(normal);
    let sine = (near / far) * (1.0 - cosine * cosine).max(0.0).sqrt();
    if cosine <= 0.0 || sine > 1.0 {
        return 1.0;
    }
    let far_cosine = (1.0 - sine * sine).sqrt();
    let s = (near * cosine - far * far_cosine) / (near * cosine + far * far_cosine);
    let p = (near * far_cosine - far * cosine) / (near * far_cosine + far * cosine);
    (s * s + p * p) / 2.0
}

/// A direction that leaves to the side of a normal: one that does not is mirrored at the surface.
pub(super) fn leaving(direction: DVec3, side: DVec3) -> DVec3 {
    if direction.dot(side) < 0.0 { mirrored(direction, side) } else { direction }
}
