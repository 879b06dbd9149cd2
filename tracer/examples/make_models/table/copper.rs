//! A copper bowl on a foot, and the lemons that the scene file puts into it.

use glam::DVec3;

use crate::generator::shape::Shape;
use crate::generator::shapes::{lathe_fine, spline};

/// A bowl of radius 10.6, 8.4 high.
pub(super) fn bowl() -> Shape {
    let profile = [
        (0.0, 0.7),
        (4.0, 0.7),
        (4.0, 0.7),
        (4.4, 0.03),
        (4.9, 0.1),
        (4.8, 0.6),
        (4.1, 1.4),
        (4.2, 1.9),
        (4.2, 1.9),
        (7.4, 3.2),
        (9.7, 5.9),
        (10.5, 8.1),
        (10.6, 8.3),
        (10.5, 8.42),
        (10.3, 8.3),
        (9.4, 6.0),
        (7.2, 3.7),
        (3.8, 2.6),
        (0.0, 2.4),
    ];
    lathe_fine(&spline(&profile, 6), 64)
}

/// A lemon round the origin, along X: two tips, and a skin that is not quite round.
pub(super) fn lemon() -> Shape {
    let profile = [
        (0.0, -4.35),
        (0.42, -4.25),
        (0.68, -3.85),
        (1.25, -3.45),
        (2.3, -2.4),
        (2.9, -0.8),
        (2.95, 0.6),
        (2.45, 2.2),
        (1.4, 3.35),
        (0.8, 3.7),
        (0.5, 4.2),
        (0.0, 4.4),
    ];
    lathe_fine(&spline(&profile, 5), 32)
        .mapped(|p| DVec3::new(p.x * (1.0 + 0.012 * p.y), p.y, p.z * 0.97 + 0.02 * p.x))
        .turned_z(-90.0)
}
