//! Soft things: boxes with round edges, cushions that bulge, pillows that thin out towards their seam.

use glam::DVec3;

use super::grid::{Ends, grid};
use crate::generator::angle::unit;
use crate::generator::shape::Shape;

/// How round and how fine a soft box is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Softness {
    /// Radius of the edges, metres.
    pub(crate) radius: f64,
    /// Pieces of an eighth of a circle.
    pub(crate) corner_steps: usize,
    /// Pieces of the flat part of each side.
    pub(crate) flat_steps: usize,
}

/// A box of `size` round the origin with round edges and corners.
pub(crate) fn rounded_box(size: DVec3, softness: Softness) -> Shape {
    let half = size / 2.0;
    let core = half - DVec3::splat(softness.radius);
    let ticks = [half.x, half.y, half.z].map(|half| ticks_along(half, softness));
    let mut solid = Shape::default();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [-1.0, 1.0] {
            let (columns, rows) = if side > 0.0 { (u, v) } else { (v, u) };
            let count = |axis: usize| (ticks[axis].len(), Ends::Open);
            solid.add(grid(count(columns), count(rows), |column, row| {
                let mut p = DVec3::ZERO;
                p[axis] = side * half[axis];
                p[columns] = ticks[columns][column];
                p[rows] = ticks[rows][row];
                rounded(p, core, softness.radius)
            }));
        }
    }
    solid.welded()
}

/// Coordinates along one edge of the sharp box, closer together where the rounding turns them into equal angles.
fn ticks_along(half: f64, softness: Softness) -> Vec<f64> {
    let flat = half - softness.radius;
    let rounding = (1..=softness.corner_steps).map(|step| {
        let direction = unit(45.0 * step as f64 / softness.corner_steps as f64);
        flat + softness.radius * direction.y / direction.x
    });
    let rounding: Vec<f64> = rounding.collect();
    let steps = softness.flat_steps;
    let middle = (0..=steps).map(|step| flat * (2.0 * step as f64 / steps as f64 - 1.0));
    rounding.iter().rev().map(|tick| -tick).chain(middle).chain(rounding.iter().copied()).collect()
}

/// A point of the sharp box, drawn in onto the sphere that rolls along the inside of its edges.
fn rounded(p: DVec3, core: DVec3, radius: f64) -> DVec3 {
    let inner = p.clamp(-core, core);
    inner + (p - inner).normalize_or_zero() * radius
}

/// A seat cushion of `size` round the origin: a rounded box whose top and bottom bulge by `bulge` in the middle.
pub(crate) fn cushion(size: DVec3, softness: Softness, bulge: f64) -> Shape {
    let half = size / 2.0;
    rounded_box(size, softness).mapped(|p| {
        let q = p / half;
        let dome = (1.0 - q.x * q.x).max(0.0) * (1.0 - q.z * q.z).max(0.0);
        p + DVec3::Y * (bulge * dome * q.y)
    })
}

/// A throw pillow of `size` (width, height, thickness) round the origin, facing +Z, with a tucked-in outline.
pub(crate) fn pillow(size: DVec3, steps: usize) -> Shape {
    let half = size / 2.0;
    let side = |sign: f64| {
        grid((steps + 1, Ends::Open), (steps + 1, Ends::Open), move |column, row| {
            let along = |i: usize| -unit(180.0 * i as f64 / steps as f64).x;
            let (u, v) = (along(column) * sign, along(row));
            pillow_point(u, v, sign) * half
        })
    };
    Shape::union([side(1.0), side(-1.0)]).welded()
}

/// A point of the pillow in a cube of half-size 1; `u` and `v` in -1..1 over its outline.
fn pillow_point(u: f64, v: f64, side: f64) -> DVec3 {
    const TUCK: f64 = 0.10;
    let thickness = ((1.0 - u * u) * (1.0 - v * v)).max(0.0).sqrt();
    let drawn_in = |along: f64, across: f64| along * (1.0 - TUCK * (1.0 - across * across));
    DVec3::new(drawn_in(u, v), drawn_in(v, u), side * thickness.sqrt() * (0.55 + 0.45 * thickness))
}
