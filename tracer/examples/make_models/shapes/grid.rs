//! A sheet of quads over a grid of points.

use glam::DVec3;

use crate::generator::shape::Shape;

/// Whether the last row or column joins the first again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ends {
    /// A sheet with an edge.
    Open,
    /// A ring.
    Joined,
}

impl Ends {
    fn cells(self, points: usize) -> usize {
        if self == Ends::Joined { points } else { points - 1 }
    }
}

/// A sheet through `point(column, row)`. Its outside is where columns run right while rows run up. Points that
/// coincide (the pole of a turned shape) become one vertex.
pub(crate) fn grid(
    columns: (usize, Ends),
    rows: (usize, Ends),
    point: impl Fn(usize, usize) -> DVec3,
) -> Shape {
    let mut sheet = Shape::default();
    for row in 0..rows.0 {
        for column in 0..columns.0 {
            sheet.vertex(point(column, row));
        }
    }
    let index = |column: usize, row: usize| ((row % rows.0) * columns.0 + column % columns.0) as u32;
    for row in 0..rows.1.cells(rows.0) {
        for column in 0..columns.1.cells(columns.0) {
            let (right, up) = (column + 1, row + 1);
            sheet.faces.push([index(column, row), index(right, row), index(right, up), index(column, up)]);
        }
    }
    sheet.welded()
}
