//! What the windows show: ridges, each paler than the ridge in front of it, and cypresses. West only.

use glam::DVec3;

use super::palette::{CYPRESS, HILLS};
use crate::generator::angle::{heading, sin};
use crate::generator::random::{between, uniform};
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{Ends, grid, lathe, spline};

/// A ridge from far to near, metres.
struct Ridge {
    distance: f64,
    /// Height of its foot and the mean of its skyline.
    foot: f64,
    skyline: f64,
    /// How far the skyline swings.
    swing: f64,
    /// How deep the slope lies back from foot to skyline.
    depth: f64,
}

const RIDGES: [Ridge; 3] = [
    Ridge { distance: 120.0, foot: -6.0, skyline: 9.5, swing: 5.0, depth: 30.0 },
    Ridge { distance: 70.0, foot: -6.0, skyline: 2.6, swing: 1.8, depth: 20.0 },
    Ridge { distance: 16.0, foot: -3.5, skyline: -0.6, swing: 0.7, depth: 22.0 },
];
/// Bearings about +Y between which the garden lies; 270 is west.
const BEARINGS: (f64, f64) = (185.0, 355.0);

/// Ridges and trees.
pub(crate) fn garden() -> Model {
    let mut model = Model::default();
    for (index, (ridge, material)) in RIDGES.iter().zip(&HILLS).enumerate() {
        model.add(material, slope(index as u64, ridge));
    }
    for tree in 0..16 {
        let (bearing, distance) = (between(90, tree, 235.0, 305.0), between(91, tree, 20.0, 46.0));
        let place = heading(bearing) * distance;
        let height = between(92, tree, 3.2, 6.0);
        model.add(&CYPRESS, cypress(tree, height).at(place.x, -3.0 + 0.05 * distance, place.z));
    }
    model
}

/// A hillside that rises away from the house to its skyline.
fn slope(index: u64, ridge: &Ridge) -> Shape {
    let (steps, rows) = (80, 6);
    grid((steps + 1, Ends::Open), (rows + 1, Ends::Open), |column, row| {
        let across = column as f64 / steps as f64;
        let bearing = BEARINGS.1 + (BEARINGS.0 - BEARINGS.1) * across;
        let phase = 110.0 * index as f64;
        let wave = 0.6 * sin(bearing * 3.1 + phase) + 0.4 * sin(bearing * 7.3 + 2.0 * phase);
        let bush = 0.06 * uniform(93, index * 1000 + column as u64);
        let up = row as f64 / rows as f64;
        let rise = up * (2.0 - up);
        let top = ridge.skyline + ridge.swing * (wave + bush);
        heading(bearing) * (ridge.distance + ridge.depth * up)
            + DVec3::Y * (ridge.foot + (top - ridge.foot) * rise)
    })
}

/// A slim tree `height` high on the origin.
fn cypress(tree: u64, height: f64) -> Shape {
    let outline =
        [(0.0, 0.0), (0.03, 0.01), (0.09, 0.12), (0.115, 0.3), (0.10, 0.55), (0.06, 0.8), (0.0, 1.0)];
    let outline = spline(&outline.map(|(radius, up)| (radius * height, up * height)), 2);
    let mut shape = lathe(&outline, 12);
    for (index, p) in shape.positions.iter_mut().enumerate() {
        let ragged = between(94, tree * 1000 + index as u64, 0.88, 1.12);
        *p *= DVec3::new(ragged, 1.0, ragged);
    }
    shape
}
