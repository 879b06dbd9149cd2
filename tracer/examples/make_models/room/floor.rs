//! The floor: oak blocks in herringbone, each with bevelled edges, its own tone, and a hair's breadth of tilt.

use glam::{DVec2, DVec3};

use super::palette::{FLOOR, GAP};
use super::plan::{HALF_X, HALF_Z, THICKNESS};
use crate::generator::angle::unit;
use crate::generator::random::{between, pick};
use crate::generator::shape::{Model, Shape};

/// Width of a block, and its length in widths.
const WIDTH: f64 = 0.13;
const RATIO: i32 = 5;
/// Width and depth of the bevel.
const BEVEL: f64 = 0.0025;
/// How far one end of a block may stand above the other.
const TILT: f64 = 0.0006;

/// The whole floor; its blocks run on into the walls.
pub(crate) fn floor() -> Model {
    let mut model = Model::default();
    let half = DVec2::new(HALF_X + THICKNESS / 2.0, HALF_Z + THICKNESS / 2.0);
    let reach = ((half.x + half.y) / WIDTH) as i32 + 2 * RATIO;
    let mut index = 0;
    for row in -reach..reach {
        for period in -reach / (2 * RATIO)..=reach / (2 * RATIO) {
            let start = row + 2 * RATIO * period;
            let lying = (DVec2::new(f64::from(start), f64::from(row)), DVec2::new(f64::from(RATIO), 1.0));
            let standing =
                (DVec2::new(f64::from(row), f64::from(start + 1)), DVec2::new(1.0, f64::from(RATIO)));
            for (corner, size) in [lying, standing] {
                if is_inside(diagonal((corner + size / 2.0) * WIDTH), half) {
                    model.add(pick(1, index, &FLOOR.each_ref()), block(index, corner * WIDTH, size * WIDTH));
                }
                index += 1;
            }
        }
    }
    let mut ground = Shape::default();
    let depth = -2.0 * BEVEL;
    ground.quad(
        [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
            .map(|(x, z)| DVec3::new(x * half.x, depth, z * half.y)),
    );
    model.add(&GAP, ground);
    model
}

fn is_inside(middle: DVec2, half: DVec2) -> bool {
    let reach = f64::from(RATIO) * WIDTH / 2.0;
    middle.x.abs() < half.x + reach && middle.y.abs() < half.y + reach
}

/// From the pattern's own axes to the room's, 45 degrees apart.
fn diagonal(p: DVec2) -> DVec2 {
    unit(45.0).rotate(p)
}

/// The visible part of one block: its top and four bevels.
fn block(index: u64, corner: DVec2, size: DVec2) -> Shape {
    let slope = DVec2::new(between(2, index, -TILT, TILT), between(3, index, -TILT, TILT)) / size;
    let mut shape = Shape::default();
    for (inset, drop) in [(BEVEL, 0.0), (0.0003, BEVEL)] {
        for (u, v) in [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)] {
            let along = DVec2::new(inset, inset) + (size - 2.0 * inset) * DVec2::new(u, v);
            let p = diagonal(corner + along);
            shape.vertex(DVec3::new(p.x, (along - size / 2.0).dot(slope) - drop, p.y));
        }
    }
    shape.faces.push([0, 1, 2, 3]);
    shape.faces.extend((0..4).map(|i| [i, i + 4, (i + 1) % 4 + 4, (i + 1) % 4]));
    shape
}
