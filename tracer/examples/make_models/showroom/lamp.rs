//! A hanging lamp: a turned shade, open below, on a rod. The bulb is at the origin; the scene file has it, and the light.

use glam::DVec3;

use crate::generator::shape::Shape;
use crate::generator::shapes::{Path, lathe_fine, spline, tube};

/// The shade outside and inside, and the rod up to the ceiling.
pub(super) fn shade() -> Shape {
    let profile = [
        (4.9, -1.6),
        (4.95, -1.55),
        (4.85, -0.6),
        (4.3, 0.9),
        (3.1, 2.4),
        (1.6, 3.3),
        (0.95, 3.7),
        (0.75, 4.4),
        (0.75, 5.6),
        (0.75, 5.6),
        (0.5, 5.8),
        (0.25, 5.9),
        (0.0, 5.9),
    ];
    let inside = [(0.0, 3.1), (1.5, 2.95), (2.9, 2.15), (4.05, 0.8), (4.65, -0.6), (4.8, -1.6), (4.9, -1.6)];
    let shell = spline(&[&inside[..], &profile[..]].concat(), 5);
    let rod = tube(&Path::line(DVec3::Y * 5.7, DVec3::Y * 60.0, 1), 12, |_| 0.14);
    Shape::union([lathe_fine(&shell, 56), rod])
}
