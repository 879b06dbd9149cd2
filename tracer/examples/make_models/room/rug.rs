//! A kilim of tufts: stepped diamonds on a field, between borders, each tuft its own little roof.

use glam::DVec3;

use super::palette::YARN;
use crate::generator::random::between;
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{Path, tube};

/// Tufts along and across, both odd so that there is a middle one.
const TUFTS: (i32, i32) = (143, 99);
/// Distance between tufts.
const PITCH: f64 = 0.0238;
/// Thickness of the rug.
const PILE: f64 = 0.011;
/// Names for the yarns.
const IVORY: usize = 0;
const RED: usize = 1;
const NAVY: usize = 2;
const OCHRE: usize = 3;
const TEAL: usize = 4;
const ROSE: usize = 5;

/// The rug round the origin, its long side along X.
pub(crate) fn rug() -> Model {
    let mut model = Model::default();
    let mut colours: [Shape; 6] = Default::default();
    for row in 0..TUFTS.1 {
        for column in 0..TUFTS.0 {
            let shape = &mut colours[colour(column, row)];
            let knots =
                [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(right, down)| knot(column + right, row + down));
            shape.quad(knots);
        }
    }
    for (material, shape) in YARN.iter().zip(colours) {
        model.add(material, shape);
    }
    model.add(&YARN[IVORY], fringe());
    model
}

/// A grid point of the pile; alternate points stand high, and the rim lies on the floor.
fn knot(column: i32, row: i32) -> DVec3 {
    let is_rim = column == 0 || row == 0 || column == TUFTS.0 || row == TUFTS.1;
    let index = (column * 1000 + row) as u64;
    let relief = if (column + row) % 2 == 0 { 0.0022 } else { -0.0012 };
    let height = if is_rim { 0.001 } else { PILE + relief + between(20, index, -0.001, 0.001) };
    let x = f64::from(column) - f64::from(TUFTS.0) / 2.0 + between(21, index, -0.06, 0.06);
    let z = f64::from(row) - f64::from(TUFTS.1) / 2.0 + between(22, index, -0.06, 0.06);
    DVec3::new(x * PITCH, height, z * PITCH)
}

/// The yarn of a tuft: borders by the distance from the rim, a lattice of diamonds inside.
fn colour(column: i32, row: i32) -> usize {
    let rim = column.min(row).min(TUFTS.0 - 1 - column).min(TUFTS.1 - 1 - row);
    match rim {
        0..=2 => NAVY,
        3 | 13 => IVORY,
        4..=12 => border(column, row, rim),
        14..=15 => RED,
        _ => field(column - TUFTS.0 / 2, row - TUFTS.1 / 2),
    }
}

/// The main border: a row of small diamonds.
fn border(column: i32, row: i32, rim: i32) -> usize {
    let along = if column == rim || column == TUFTS.0 - 1 - rim { row } else { column };
    let step = (along % 10 - 5).abs() + (rim - 8).abs();
    match step {
        0..=1 => OCHRE,
        2..=3 => RED,
        4 => IVORY,
        _ => TEAL,
    }
}

/// The field, measured from the middle of the rug.
fn field(x: i32, z: i32) -> usize {
    let (half_width, half_height) = (22, 20);
    // Steps of two tufts, as a weaver makes a slanted edge.
    let stepped = |distance: i32| distance / 2 * 2;
    let local = (x + half_width).rem_euclid(2 * half_width) - half_width;
    let across = (z + half_height).rem_euclid(2 * half_height) - half_height;
    let ring = stepped(local.abs()) + stepped(across.abs());
    let odd = ((x + half_width).div_euclid(2 * half_width) + (z + half_height).div_euclid(2 * half_height))
        % 2
        != 0;
    match ring {
        0..=2 => IVORY,
        3..=5 => {
            if odd {
                NAVY
            } else {
                RED
            }
        }
        6..=9 => {
            if odd {
                OCHRE
            } else {
                ROSE
            }
        }
        10..=11 => IVORY,
        12..=16 => {
            if odd {
                TEAL
            } else {
                NAVY
            }
        }
        17..=18 => OCHRE,
        19..=20 => NAVY,
        21..=26 => RED,
        27..=28 => ROSE,
        _ => {
            if (stepped(local.abs()) - stepped(across.abs())).abs() < 3 {
                OCHRE
            } else {
                RED
            }
        }
    }
}

/// Loose threads at both short ends.
fn fringe() -> Shape {
    let half_length = f64::from(TUFTS.0) * PITCH / 2.0;
    let count = TUFTS.1 / 2;
    let threads = (0..2 * count).map(|i| {
        let (side, place) = (if i % 2 == 0 { -1.0 } else { 1.0 }, f64::from(i / 2) + 0.5);
        let index = i as u64;
        let z = (place * 2.0 - f64::from(TUFTS.1 - 1) / 2.0) * PITCH;
        let start = DVec3::new(side * half_length, 0.004, z);
        let sway = between(23, index, -0.012, 0.012);
        let end = DVec3::new(side * (half_length + between(24, index, 0.05, 0.075)), 0.003, z + sway);
        tube(&Path::line(start, end, 2), 4, |t| 0.0035 - 0.001 * t)
    });
    Shape::union(threads)
}
