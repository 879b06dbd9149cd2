//! One channel of some rows, with filters along its two axes.

/// Values of one channel, row by row.
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) values: Vec<f32>,
}

impl Plane {
    /// An empty plane with room for `rows` rows.
    pub(super) fn with_capacity(width: usize, rows: usize) -> Self {
        Self { width, values: Vec::with_capacity(width * rows) }
    }

    fn zero(width: usize, rows: usize) -> Self {
        Self { width, values: vec![0.0; width * rows] }
    }

    fn rows(&self) -> usize {
        self.values.len() / self.width
    }

    /// Convolves each row with an odd number of taps; beyond the ends, the outermost values repeat.
    pub(super) fn across(&self, taps: &[f32]) -> Self {
        let radius = taps.len() / 2;
        let mut out = Self::zero(self.width, self.rows());
        let mut padded = vec![0.0; self.width + 2 * radius];
        for (row, out) in self.values.chunks_exact(self.width).zip(out.values.chunks_exact_mut(self.width)) {
            padded[..radius].fill(row[0]);
            padded[radius..radius + self.width].copy_from_slice(row);
            padded[radius + self.width..].fill(row[self.width - 1]);
            for (shift, tap) in taps.iter().enumerate() {
                add_scaled(out, *tap, &padded[shift..]);
            }
        }
        out
    }

    /// Convolves the columns, for the `rows` middle rows: there are at least as many above and below them as the
    /// radius of the taps.
    pub(super) fn down(&self, taps: &[f32], rows: usize) -> Self {
        let above = (self.rows() - rows) / 2 - taps.len() / 2;
        let mut out = Self::zero(self.width, rows);
        for (y, out) in out.values.chunks_exact_mut(self.width).enumerate() {
            for (shift, tap) in taps.iter().enumerate() {
                add_scaled(out, *tap, &self.values[(above + y + shift) * self.width..]);
            }
        }
        out
    }

    /// Combines two planes of one size, value by value.
    pub(super) fn with(mut self, other: &Self, combine: impl Fn(f32, f32) -> f32) -> Self {
        for (a, b) in self.values.iter_mut().zip(&other.values) {
            *a = combine(*a, *b);
        }
        self
    }
}

fn add_scaled(out: &mut [f32], factor: f32, values: &[f32]) {
    for (out, value) in out.iter_mut().zip(values) {
        *out += factor * value;
    }
}

/// Samples of a function at the integers from `-radius` to `radius`, as taps.
pub(super) fn sampled(radius: usize, function: impl Fn(f64) -> f64) -> Vec<f64> {
    let radius = radius as i32;
    (-radius..=radius).map(|x| function(f64::from(x))).collect()
}
