//! A grid over points: finds those in and near a triangle without testing all of them.

use glam::{DVec2, UVec2};

/// Points per cell on average.
const POINTS_PER_CELL: usize = 2;

/// Share of a cell by which rounding may move a point into a neighbouring cell.
const MARGIN: f64 = 1e-6;

/// Least width and height of a grid, as a share of the larger one: points may be collinear.
const LEAST_EXTENT: f64 = 1e-9;

/// Points in rows of cells.
#[derive(Default)]
pub(super) struct Grid {
    lowest: DVec2,
    cells_per_unit: DVec2,
    size: UVec2,
    /// Offset of each cell's points, and their remaining number.
    cells: Vec<(u32, u32)>,
    points: Vec<u32>,
}

impl Grid {
    /// A grid over the points that `chosen` lists.
    pub(super) fn of(points: &[DVec2], chosen: &[u32]) -> Self {
        if chosen.is_empty() {
            return Self::default();
        }
        let at = |&chosen: &u32| points[chosen as usize];
        let (lowest, highest) =
            chosen.iter().map(at).fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), point| {
                (low.min(point), high.max(point))
            });
        let extent = highest - lowest;
        let extent = extent.max(DVec2::splat(LEAST_EXTENT * extent.max_element().max(f64::MIN_POSITIVE)));
        let wanted = (chosen.len() / POINTS_PER_CELL).max(1) as f64;
        // Cells as square as possible, and at most as many per row as points.
        let columns = (wanted * extent.x / extent.y).sqrt().clamp(1.0, wanted).floor();
        let rows = (wanted / columns).clamp(1.0, wanted).floor();
        let size = UVec2::new(columns as u32, rows as u32);
        let mut grid = Self {
            lowest,
            cells_per_unit: DVec2::new(columns, rows) / extent,
            size,
            cells: vec![(0, 0); size.x as usize * size.y as usize],
            points: vec![0; chosen.len()],
        };
        grid.fill(points, chosen);
        grid
    }

    /// Counting sort of the points by cell.
    fn fill(&mut self, points: &[DVec2], chosen: &[u32]) {
        let cell_of: Vec<usize> = chosen
            .iter()
            .map(|&chosen| {
                let place = self.place(points[chosen as usize]);
                self.cell(self.column(place.x), self.row(place.y))
            })
            .collect();
        for &cell in &cell_of {
            self.cells[cell].1 += 1;
        }
        let mut start = 0;
        for cell in &mut self.cells {
            start += std::mem::replace(cell, (start, 0)).1;
        }
        for (&chosen, cell) in chosen.iter().zip(cell_of) {
            let (start, count) = &mut self.cells[cell];
            self.points[(*start + *count) as usize] = chosen;
            *count += 1;
        }
    }

    /// Whether a point in the cells of a triangle matches. Obsolete points are removed from the grid. Examined cells
    /// and points are added to `work`.
    pub(super) fn any(
        &mut self,
        triangle: [DVec2; 3],
        is_wanted: impl Fn(u32) -> bool,
        is_found: impl Fn(u32) -> bool,
        work: &mut u64,
    ) -> bool {
        if self.points.is_empty() {
            return false;
        }
        let triangle = triangle.map(|corner| self.place(corner));
        let [a, b, c] = triangle.map(|corner| corner.y);
        for row in self.row(a.min(b).min(c) - MARGIN)..=self.row(a.max(b).max(c) + MARGIN) {
            let Some((left, right)) = span(triangle, f64::from(row)) else { continue };
            for column in self.column(left - MARGIN)..=self.column(right + MARGIN) {
                let cell = self.cell(column, row);
                let (start, mut count) = self.cells[cell];
                *work += 1 + u64::from(count);
                let mut i = start;
                while i < start + count {
                    let point = self.points[i as usize];
                    if !is_wanted(point) {
                        count -= 1;
                        self.points.swap(i as usize, (start + count) as usize);
                        continue;
                    }
                    if is_found(point) {
                        self.cells[cell].1 = count;
                        return true;
                    }
                    i += 1;
                }
                self.cells[cell].1 = count;
            }
        }
        false
    }

    /// Coordinates in cells from the grid's lower corner.
    fn place(&self, point: DVec2) -> DVec2 {
        (point - self.lowest) * self.cells_per_unit
    }

    // Conversions saturate, so that points outside are in the outermost cells.
    fn column(&self, x: f64) -> u32 {
        (x as u32).min(self.size.x - 1)
    }

    fn row(&self, y: f64) -> u32 {
        (y as u32).min(self.size.y - 1)
    }

    fn cell(&self, column: u32, row: u32) -> usize {
        row as usize * self.size.x as usize + column as usize
    }
}

/// The part of a row that a triangle overlaps.
fn span(triangle: [DVec2; 3], row: f64) -> Option<(f64, f64)> {
    let (low, high) = (row - MARGIN, row + 1.0 + MARGIN);
    let mut span: Option<(f64, f64)> = None;
    for i in 0..3 {
        let (p, q) = (triangle[i], triangle[(i + 1) % 3]);
        let (p, q) = if p.y <= q.y { (p, q) } else { (q, p) };
        if q.y < low || p.y > high {
            continue;
        }
        let at = |y: f64| p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y)).clamp(0.0, 1.0);
        let from = if p.y < low { at(low) } else { p.x };
        let to = if q.y > high { at(high) } else { q.x };
        let (left, right) = (from.min(to), from.max(to));
        span = Some(span.map_or((left, right), |(l, r)| (l.min(left), r.max(right))));
    }
    span
}
