//! Patterns of cubes or squares in two colours.
//!
//! The cell of a point is the sum over the axes of floor(coordinate / size); even ones have the first colour. Coordinates are in the
//! world, in the object (see [`Place::in_object`]) or in a texture. In the world and in objects a point is moved by a thousandth of a
//! cell to the back of its surface, against [`Place::normal`]: a floor exactly between two layers of cells shows those below it,
//! whichever way its points are rounded, and the side of a box those inside of it.

use glam::{DVec3, Vec3};

use super::place::Place;
use crate::scene::{Checker, CheckerSpace};

/// Part of a cell by which points are moved.
const BEHIND: f64 = 1.0 / 1024.0;

/// The colour of a place. Places without texture coordinates have the first one where the pattern needs them.
pub(super) fn color_of(pattern: &Checker, place: &Place<'_>) -> Vec3 {
    let cell = |point: DVec3, normal: DVec3| cell_of(point / f64::from(pattern.size) - normal * BEHIND);
    let cell = match pattern.space {
        CheckerSpace::World => cell(place.in_world(), place.normal()),
        CheckerSpace::Object => cell(place.in_object(), place.normal_in_object()),
        CheckerSpace::Uv => {
            let uv = place.uv().unwrap_or_default() / f64::from(pattern.size);
            cell_of(uv.extend(0.0))
        }
    };
    pattern.colors[cell]
}

/// 0 for even cells, 1 for odd ones.
fn cell_of(point: DVec3) -> usize {
    let of_axis = |coordinate: f64| coordinate.floor().rem_euclid(2.0);
    usize::from(point.to_array().into_iter().map(of_axis).sum::<f64>().rem_euclid(2.0) == 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_alternate_along_every_axis_and_through_zero() {
        assert_eq!(cell_of(DVec3::splat(0.5)), 0);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            for step in -5..5 {
                let parity = i32::rem_euclid(step, 2) as usize;
                assert_eq!(cell_of(DVec3::splat(0.5) + axis * f64::from(step)), parity, "{axis} {step}");
            }
        }
        assert_eq!(cell_of(DVec3::new(-0.5, -0.5, 0.5)), 0);
        assert_eq!(cell_of(DVec3::new(1e15 + 1.0, 0.5, 0.5)), 1);
        assert_eq!(cell_of(DVec3::new(1e300, 0.5, 0.5)), 0, "all numbers of this size are even");
    }
}
