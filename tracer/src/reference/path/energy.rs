//! Energy of rough reflection: the tables of `bsdf::scattering::albedo`, which its tests compare with integrals, read in double precision.

use crate::bsdf::scattering::{STEPS, TABLE};

/// The row of an alpha.
#[derive(Clone, Copy)]
pub(super) struct Row(f64);

/// The terms of a lobe at a cosine: the scale s, and the share 1 - E = (1 - F0) (a + F0 b) that it leaves.
#[derive(Clone, Copy)]
pub(super) struct LobeTerms {
    pub scale: f64,
    pub a: f64,
    pub b: f64,
}

impl Row {
    pub(super) fn of(alpha: f64) -> Self {
        Self(place(alpha))
    }

    /// The terms at a cosine.
    pub(super) fn at(self, cosine: f64) -> LobeTerms {
        self.between(place(cosine))
    }

    /// Means of a and b over the cosine-weighted hemisphere: integrals over x = sqrt(cos) with the weight 4 x^3. Between two columns the
    /// terms are linear, so the integrand is a polynomial of degree 4, and Boole's rule is exact.
    pub(super) fn means(self) -> [f64; 2] {
        let steps = STEPS as f64;
        let mut means = [0.0; 2];
        for column in 0..STEPS {
            for (i, weight) in [7.0, 32.0, 12.0, 32.0, 7.0].into_iter().enumerate() {
                let place = column as f64 + i as f64 / 4.0;
                let LobeTerms { a, b, .. } = self.between(place);
                let weight = weight / 90.0 / steps * 4.0 * (place / steps).powi(3);
                means[0] += weight * a;
                means[1] += weight * b;
            }
        }
        means
    }

    fn between(self, column: f64) -> LobeTerms {
        let term = |k: usize| {
            let along = |row: usize| {
                let entry = |column: usize| f64::from(TABLE[row][column][k]);
                let (first, share) = split(column);
                entry(first) * (1.0 - share) + entry(first + 1) * share
            };
            let (first, share) = split(self.0);
            along(first) * (1.0 - share) + along(first + 1) * share
        };
        LobeTerms { scale: term(0), a: term(1), b: term(2) }
    }
}

/// The place of a number from 0 to 1 among the rows or columns, which are even steps of its square root.
fn place(number: f64) -> f64 {
    number.clamp(0.0, 1.0).sqrt() * STEPS as f64
}

fn split(place: f64) -> (usize, f64) {
    let first = (place.floor() as usize).min(STEPS - 1);
    (first, place - first as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_of_many_places() {
        for alpha in [0.0, 0.3, 1.0] {
            let row = Row::of(alpha);
            let count = 100_000;
            // Places whose squares are uniform have the cosine as their density.
            let cosines = (0..count).map(|i| ((f64::from(i) + 0.5) / f64::from(count)).sqrt());
            let (mut a, mut b) = (0.0, 0.0);
            for terms in cosines.map(|cosine| row.at(cosine)) {
                a += terms.a / f64::from(count);
                b += terms.b / f64::from(count);
            }
            let means = row.means();
            assert!((means[0] - a).abs() < 1e-6 && (means[1] - b).abs() < 1e-6, "{means:?}, not {a} and {b}");
        }
    }
}
