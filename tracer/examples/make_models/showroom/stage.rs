//! What stands round the product: a turntable, whose top is a disk of the scene file, and a slim vase.

use crate::generator::shape::Shape;
use crate::generator::shapes::{lathe_fine, spline};

/// A ring of radius 13 whose inside is closed at the height of 1.58.
pub(super) fn turntable() -> Shape {
    let profile = [
        (0.0, 0.05),
        (12.0, 0.05),
        (12.0, 0.05),
        (12.2, 0.4),
        (12.9, 0.5),
        (12.9, 0.5),
        (13.0, 0.6),
        (13.0, 1.45),
        (12.85, 1.6),
        (12.5, 1.66),
        (12.35, 1.62),
        (12.3, 1.58),
        (12.3, 1.58),
        (0.0, 1.58),
    ];
    lathe_fine(&spline(&profile, 4), 128)
}

/// A vase of 24 with a narrow neck.
pub(super) fn vase() -> Shape {
    let profile = [
        (0.0, 0.02),
        (2.4, 0.02),
        (2.4, 0.02),
        (2.7, 0.2),
        (2.9, 0.7),
        (4.1, 3.6),
        (4.6, 6.6),
        (4.0, 10.0),
        (2.2, 13.6),
        (1.2, 17.0),
        (1.0, 20.2),
        (1.4, 22.8),
        (2.1, 24.0),
        (2.1, 24.1),
        (1.95, 24.1),
        (1.2, 22.8),
        (0.8, 20.2),
        (0.0, 19.6),
    ];
    lathe_fine(&spline(&profile, 6), 56)
}
