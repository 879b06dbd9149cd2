//! A teapot and a spoon, of polished silver.

use glam::{DVec2, DVec3};

use crate::generator::shape::Shape;
use crate::generator::shapes::{Ends, Path, disc, grid, lathe_fine, spline, sweep, tube};

/// Belly with lid, and a spout towards +X.
pub(super) fn teapot() -> Shape {
    let body = [
        (0.0, 0.35),
        (4.3, 0.35),
        (4.3, 0.35),
        (4.6, 0.02),
        (5.0, 0.1),
        (5.1, 0.5),
        (4.7, 1.1),
        (4.7, 1.1),
        (7.0, 3.3),
        (8.2, 6.4),
        (7.5, 9.6),
        (5.4, 11.9),
        (4.6, 12.4),
        (4.6, 12.4),
        (4.3, 12.5),
        (4.3, 12.7),
        (4.3, 12.7),
        (4.62, 12.75),
        (4.6, 13.0),
        (3.9, 13.6),
        (2.4, 14.5),
        (1.0, 15.0),
        (0.0, 15.1),
    ];
    let path =
        Path::in_xy(&[(5.6, 3.6), (8.6, 4.6), (10.6, 7.2), (11.8, 10.4), (13.2, 12.4), (14.3, 13.1)], 4);
    let spout = tube(&path, 24, |t| 1.8 - 1.45 * t + 0.40 * t * t);
    Shape::union([lathe_fine(&spline(&body, 6), 64), spout])
}

/// Its handle and its knob.
pub(super) fn teapot_handle() -> Shape {
    let path = Path::in_xy(
        &[(-6.0, 10.6), (-9.4, 11.9), (-12.6, 11.2), (-14.0, 8.4), (-13.0, 5.4), (-10.2, 3.7), (-7.3, 4.1)],
        5,
    );
    let handle = sweep(&path, 16, |_, corner| disc(corner, 16) * DVec2::new(0.55, 0.8));
    let knob =
        [(0.0, 14.9), (0.55, 15.0), (0.5, 15.4), (0.95, 15.9), (1.15, 16.6), (0.75, 17.3), (0.0, 17.5)];
    Shape::union([handle, lathe_fine(&spline(&knob, 5), 32)])
}

/// A spoon along X, its bowl towards +X, on Y = 0.
pub(super) fn spoon() -> Shape {
    let (columns, rows) = (25, 13);
    let bowl = grid((columns, Ends::Open), (rows, Ends::Open), |column, row| {
        let along = |i: usize, count: usize| -1.0 + 2.0 * i as f64 / (count - 1) as f64;
        let (u, v) = (along(column, columns), along(row, rows));
        let width = (1.0 - u * u).max(0.0).sqrt() * (2.15 + 0.35 * u);
        let depth = 1.0 * (1.0 - u * u) * (1.0 - v * v);
        DVec3::new(7.2 + 3.1 * u, 1.05 - depth, -width * v)
    });
    let stem = Path::in_xy(&[(4.5, 0.98), (2.6, 1.45), (-2.5, 1.2), (-7.0, 0.75), (-10.5, 0.62)], 5);
    let stem = sweep(&stem, 16, |t, corner| {
        let (middle, quarter) = (2.0 * t - 1.0, (2.0 * t - 1.0) * (2.0 * t - 1.0));
        let end = (1.0 - quarter * quarter * middle * middle).max(0.0).sqrt();
        disc(corner, 16) * DVec2::new(0.30 + 0.55 * t * t * t, 0.17) * (0.25 + 0.75 * end)
    });
    Shape::union([bowl, stem])
}
