//! Random places in a picture of a sky, in proportion to the light that comes from there.
//!
//! The probability is constant in each cell of a grid. A place is found by inverting the cumulative probabilities of the rows, and of
//! the cells of the row, so that evenly spread numbers give evenly spread places (Pharr, Jakob and Humphreys, "Physically Based
//! Rendering", 2023, 12.5).

use super::Texture;

/// Most cells: of larger pictures several texels are one cell.
const MAX_CELLS: u64 = 1 << 21;

/// A piecewise constant probability density over [0, 1) x [0, 1).
#[derive(Clone, Debug)]
pub(crate) struct Distribution {
    columns: usize,
    /// Cumulative probabilities of the rows.
    rows: Vec<f32>,
    /// Cumulative probabilities of the cells of each row.
    cells: Vec<f32>,
    /// Integral of the weights over the square.
    total: f64,
}

/// A random place, and the probability density there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub at: [f32; 2],
    pub density: f32,
}

impl Distribution {
    /// The density that is proportional to weights of cells, row by row; `None` if all are 0.
    pub(super) fn new(weights: &[f32], columns: usize) -> Option<Self> {
        let mut cells = Vec::with_capacity(weights.len());
        let mut of_rows = Vec::new();
        for row in weights.chunks_exact(columns) {
            of_rows.push(row.iter().map(|&weight| f64::from(weight)).sum::<f64>());
            cells.extend(cumulative(row.iter().map(|&weight| f64::from(weight))));
        }
        let total = of_rows.iter().sum::<f64>() / weights.len() as f64;
        let rows = cumulative(of_rows.iter().copied()).collect();
        (total > 0.0 && total.is_finite()).then_some(Self { columns, rows, cells, total })
    }

    /// Mean of the weights.
    pub(crate) fn total(&self) -> f64 {
        self.total
    }

    /// The place of two numbers in [0, 1).
    pub(crate) fn place(&self, [x, y]: [f32; 2]) -> Place {
        let (row, along, of_row) = find(&self.rows, y);
        let (column, across, of_cell) = find(self.row(row), x);
        let (width, height) = (self.columns as f32, self.rows.len() as f32);
        let at = [(column as f32 + across) / width, (row as f32 + along) / height];
        Place { at, density: of_row * height * of_cell * width }
    }

    /// The probability density at a place.
    pub(crate) fn density(&self, [x, y]: [f32; 2]) -> f32 {
        let (width, height) = (self.columns as f32, self.rows.len() as f32);
        // A negative number or NaN becomes 0.
        let row = ((y * height) as usize).min(self.rows.len() - 1);
        let column = ((x * width) as usize).min(self.columns - 1);
        share(&self.rows, row) * height * share(self.row(row), column) * width
    }

    fn row(&self, row: usize) -> &[f32] {
        &self.cells[row * self.columns..(row + 1) * self.columns]
    }

    /// The distribution of the light of a panorama over its picture, whose rows begin at the bottom.
    fn of_panorama(texture: &Texture) -> Option<Self> {
        let texels = u64::from(texture.width()) * u64::from(texture.height());
        let mut side = 1;
        while texels.div_ceil(side * side) > MAX_CELLS {
            side += 1;
        }
        let side = side as u32;
        let (columns, rows) = (texture.width().div_ceil(side), texture.height().div_ceil(side));
        let means = means(texture, side, [columns, rows]);
        Self::new(&widened(&means, columns as usize), columns as usize)
    }
}

impl Texture {
    /// The distribution of the light of the panorama, made at the first call; `None` if it is black.
    pub(crate) fn light(&self) -> Option<&Distribution> {
        if let Some(light) = self.light.get() {
            return light.as_ref();
        }
        let made = Distribution::of_panorama(self);
        self.light.get_or_init(|| made).as_ref()
    }
}

/// Mean light of cells of `side` x `side` texels: red, green and blue added, times the area that they have on the sphere.
fn means(texture: &Texture, side: u32, [columns, rows]: [u32; 2]) -> Vec<f32> {
    let (width, height) = (texture.width(), texture.height());
    let mut means = Vec::with_capacity(columns as usize * rows as usize);
    for row in 0..rows {
        let middle = (f64::from(row) + 0.5) / f64::from(rows);
        let area = libm::sin(std::f64::consts::PI * middle) as f32;
        for column in 0..columns {
            let (mut sum, mut count) = (0.0, 0.0_f32);
            for y in row * side..((row + 1) * side).min(height) {
                for x in column * side..((column + 1) * side).min(width) {
                    let [r, g, b] = texture.linear_texel(x, y);
                    sum += r + g + b;
                    count += 1.0;
                }
            }
            means.push(area * sum / count.max(1.0));
        }
    }
    means
}

/// Each cell averaged with its neighbours, weighted 1 : 2 : 1: bilinear lookups spread the light of a texel. Left and right border are
/// neighbours.
fn widened(cells: &[f32], columns: usize) -> Vec<f32> {
    let rows = cells.len() / columns;
    let at = |x: usize, y: usize| cells[y * columns + x];
    let mut wide = Vec::with_capacity(cells.len());
    for y in 0..rows {
        let (below, above) = (y.saturating_sub(1), (y + 1).min(rows - 1));
        let column = |x: usize| (at(x, below) + 2.0 * at(x, y) + at(x, above)) / 4.0;
        for x in 0..columns {
            let (left, right) = ((x + columns - 1) % columns, (x + 1) % columns);
            wide.push((column(left) + 2.0 * column(x) + column(right)) / 4.0);
        }
    }
    wide
}

/// Cumulative probabilities of weights; even ones if all weights are 0.
fn cumulative(weights: impl ExactSizeIterator<Item = f64> + Clone) -> impl Iterator<Item = f32> {
    let total: f64 = weights.clone().sum();
    let (count, even) = (weights.len(), !(total > 0.0));
    let total = if even { count as f64 } else { total };
    let mut sum = 0.0;
    let last = weights.clone().enumerate().filter(|(_, weight)| *weight > 0.0).last();
    let last = if even { count - 1 } else { last.map_or(0, |(index, _)| index) };
    weights.enumerate().map(move |(index, weight)| {
        sum += if even { 1.0 } else { weight };
        if index >= last { 1.0 } else { (sum / total) as f32 }
    })
}

/// The interval of cumulative probabilities that a number is in, where in it, and its probability.
fn find(ends: &[f32], number: f32) -> (usize, f32, f32) {
    let index = ends.partition_point(|&end| end <= number).min(ends.len() - 1);
    let start = if index == 0 { 0.0 } else { ends[index - 1] };
    let probability = ends[index] - start;
    let within = if probability > 0.0 { (number - start) / probability } else { 0.5 };
    (index, within.clamp(0.0, 1.0 - f32::EPSILON), probability)
}

/// Probability of an interval.
fn share(ends: &[f32], index: usize) -> f32 {
    let start = if index == 0 { 0.0 } else { ends[index - 1] };
    ends[index] - start
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn places_are_where_the_weights_are_and_densities_agree(
            weights in prop::collection::vec(prop_oneof![Just(0.0_f32), 0.0_f32..10.0], 12),
        ) {
            let total: f32 = weights.iter().sum();
            let Some(distribution) = Distribution::new(&weights, 4) else {
                prop_assert!(total == 0.0);
                return Ok(());
            };
            prop_assert!((distribution.total() - f64::from(total) / 12.0).abs() < 1e-4);
            let mut counts = [0.0; 12];
            let steps = 64;
            for i in 0..steps * steps {
                let number = |k: i32| (k as f32 + 0.5) / steps as f32;
                let place = distribution.place([number(i % steps), number(i / steps)]);
                let [x, y] = place.at;
                prop_assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
                let cell = (x * 4.0) as usize + 4 * (y * 3.0) as usize;
                counts[cell] += 1.0 / (steps * steps) as f32;
                prop_assert!(weights[cell] > 0.0, "a place without weight");
                let expected = weights[cell] * 12.0 / total;
                prop_assert!((place.density - expected).abs() < 1e-3 * expected + 1e-4);
            }
            for (count, weight) in counts.iter().zip(&weights) {
                prop_assert!((count - weight / total).abs() < 0.05, "{counts:?} {weights:?}");
            }
        }
    }
}
