//! Trigonometry in degrees by `libm`, whose results are the same on every platform (the standard library's are not).

use glam::{DVec2, DVec3};

/// Sine of an angle in degrees.
pub(crate) fn sin(degrees: f64) -> f64 {
    libm::sin(degrees.to_radians())
}

/// Cosine of an angle in degrees.
pub(crate) fn cos(degrees: f64) -> f64 {
    libm::cos(degrees.to_radians())
}

/// The point of the unit circle at an angle.
pub(crate) fn unit(degrees: f64) -> DVec2 {
    DVec2::new(cos(degrees), sin(degrees))
}

/// The unit direction in the floor plane at an angle about +Y; 0 is +Z, 90 is +X.
pub(crate) fn heading(degrees: f64) -> DVec3 {
    DVec3::new(sin(degrees), 0.0, cos(degrees))
}

/// `p` turned about +X, right-handed.
pub(crate) fn turn_x(p: DVec3, degrees: f64) -> DVec3 {
    let (s, c) = (sin(degrees), cos(degrees));
    DVec3::new(p.x, c * p.y - s * p.z, s * p.y + c * p.z)
}

/// `p` turned about +Y, right-handed.
pub(crate) fn turn_y(p: DVec3, degrees: f64) -> DVec3 {
    let (s, c) = (sin(degrees), cos(degrees));
    DVec3::new(c * p.x + s * p.z, p.y, c * p.z - s * p.x)
}

/// `p` turned about +Z, right-handed.
pub(crate) fn turn_z(p: DVec3, degrees: f64) -> DVec3 {
    let (s, c) = (sin(degrees), cos(degrees));
    DVec3::new(c * p.x - s * p.y, s * p.x + c * p.y, p.z)
}
