//! A flacon of thick glass, the perfume in it, and its collar. The stopper is a ball, which the scene file has.

use glam::DVec3;

use crate::generator::shape::Shape;
use crate::generator::shapes::{Softness, lathe_fine, rounded_box, spline};

/// Width, height and depth of the block of glass, and of its cavity.
const BLOCK: DVec3 = DVec3::new(7.6, 9.2, 4.2);
const CAVITY: DVec3 = DVec3::new(5.9, 6.7, 2.7);
/// Height of the glass below the cavity.
const BASE: f64 = 1.6;
/// Height of the perfume's surface.
const LEVEL: f64 = 6.3;
/// Perfume and glass overlap by this much, so that no air is between them.
const OVERLAP: f64 = 0.1;

/// A block with round edges and a cavity.
pub(super) fn glass() -> Shape {
    let outside = rounded_box(BLOCK, soft(0.75)).at(0.0, BLOCK.y / 2.0 + 0.02, 0.0);
    Shape::union([outside, cavity(0.0).inside_out()])
}

/// The cavity up to the level.
pub(super) fn perfume() -> Shape {
    // Points above the level come down to it: they make its surface.
    cavity(OVERLAP).mapped(|p| DVec3::new(p.x, p.y.min(LEVEL), p.z)).welded()
}

/// The cavity, larger by `margin` on all sides.
fn cavity(margin: f64) -> Shape {
    let size = CAVITY + DVec3::splat(2.0 * margin);
    rounded_box(size, soft(0.6 + margin)).at(0.0, BASE + CAVITY.y / 2.0, 0.0)
}

fn soft(radius: f64) -> Softness {
    Softness { radius, corner_steps: 5, flat_steps: 1 }
}

/// A grooved collar on the block, with a cup for the stopper.
pub(super) fn collar() -> Shape {
    let profile = [
        (0.0, 0.0),
        (1.75, 0.0),
        (1.75, 0.0),
        (1.85, 0.08),
        (1.85, 0.34),
        (1.75, 0.42),
        (1.6, 0.47),
        (1.6, 0.47),
        (1.6, 0.62),
        (1.6, 0.62),
        (1.7, 0.67),
        (1.72, 0.8),
        (1.7, 0.93),
        (1.6, 0.98),
        (1.6, 0.98),
        (1.6, 1.1),
        (1.6, 1.1),
        (1.72, 1.15),
        (1.82, 1.35),
        (1.85, 1.55),
        (1.8, 1.6),
        (1.72, 1.58),
        (1.4, 1.32),
        (0.8, 1.08),
        (0.0, 1.0),
    ];
    lathe_fine(&spline(&profile, 4), 64)
}
