//! Closed bodies of glass with an outer and an inner wall, and the liquids in them.

use glam::DVec2;

use crate::generator::shape::Shape;
use crate::generator::shapes::{lathe_fine, spline};

/// Pieces round a glass.
const SEGMENTS: usize = 48;

/// A glass on a stem, 21 high: foot, stem, bowl, rim, and down again inside.
pub(super) fn wine_glass() -> Shape {
    let profile = [
        (0.0, 0.0),
        (3.45, 0.0),
        (3.45, 0.0),
        (3.58, 0.06),
        (3.50, 0.17),
        (2.4, 0.36),
        (1.1, 0.72),
        (0.48, 1.5),
        (0.34, 3.2),
        (0.34, 6.6),
        (0.48, 7.9),
        (1.25, 8.75),
        (2.7, 9.9),
        (3.75, 11.6),
        (4.25, 14.0),
        (4.1, 17.2),
        (3.52, 20.9),
        (3.47, 20.98),
        (3.41, 20.9),
        (3.97, 17.2),
        (4.11, 14.0),
        (3.61, 11.7),
        (2.6, 10.1),
        (1.25, 9.15),
        (0.0, 8.9),
    ];
    lathe_fine(&spline(&profile, 7), SEGMENTS)
}

/// Wine up to the widest part of a glass.
pub(super) fn wine() -> Shape {
    let middle_of_wall = [(0.0, 8.75), (1.25, 8.95), (2.65, 10.0), (3.68, 11.65), (4.18, 14.0), (4.03, 17.2)];
    lathe_fine(&filled(&spline(&middle_of_wall, 7), 13.2), SEGMENTS)
}

/// A carafe of 25 with a wide lip. Its stopper is a ball, which the scene file has.
pub(super) fn carafe() -> Shape {
    let profile = [
        (0.0, 0.12),
        (4.6, 0.12),
        (5.0, 0.0),
        (5.6, 0.2),
        (6.2, 1.5),
        (6.5, 4.2),
        (6.0, 8.2),
        (4.5, 12.2),
        (2.85, 15.6),
        (2.15, 18.6),
        (2.2, 21.2),
        (2.75, 24.2),
        (3.05, 24.9),
        (3.0, 25.1),
        (2.82, 25.05),
        (2.45, 24.1),
        (1.9, 21.2),
        (1.87, 18.6),
        (2.57, 15.5),
        (4.22, 12.1),
        (5.7, 8.2),
        (6.2, 4.2),
        (5.85, 1.9),
        (4.9, 1.0),
        (0.0, 0.9),
    ];
    lathe_fine(&spline(&profile, 7), SEGMENTS)
}

/// Water in the carafe.
pub(super) fn water() -> Shape {
    let middle_of_wall =
        [(0.0, 0.5), (5.0, 0.55), (6.03, 1.7), (6.35, 4.2), (5.85, 8.2), (4.36, 12.15), (2.71, 15.55)];
    lathe_fine(&filled(&spline(&middle_of_wall, 7), 11.0), SEGMENTS)
}

/// The wall up to a level, and a flat surface there.
fn filled(wall: &[DVec2], level: f64) -> Vec<DVec2> {
    let mut profile: Vec<DVec2> = wall.iter().copied().take_while(|point| point.y < level).collect();
    if let (Some(&low), Some(&high)) = (profile.last(), wall.get(profile.len())) {
        profile.push(low.lerp(high, (level - low.y) / (high.y - low.y)));
    }
    profile.push(DVec2::new(0.0, level));
    profile
}
