//! Energy of rough reflection: light that a microfacet sends to another one is lost in [`super::ggx`], and is put back by scaling.
//!
//! Turquin ("Practical multiple scattering compensation for microfacet models", 2019) multiplies f by 1 + F0 (1 - E(v)) / E(v) with the albedo
//! E of F = 1. That is not reciprocal. Here the factor is 1 + F0 (s(v) s(l) - 1), and s is the solution of
//!
//! ```text
//! s(v) integral f1(v, l) s(l) cos dl = 1                for all v
//! ```
//!
//! so that the albedo is 1 for F0 = 1. It is found by Sinkhorn's iteration. With Schlick's share F0 + (1 - F0) (1 - v.h)^5 the lobe has the albedo
//!
//! ```text
//! E(v) = 1 - (1 - F0) g(v),  g = a + F0 b
//! a = 1 - I(c),  b = 1 - I(1) - J(c) + I(c)
//! ```
//!
//! where I(x) is the integral of f1 x cos, J(x) that of f1 x s(v) s(l) cos, and c = (1 - v.h)^5. A diffuse surface below the lobe gets the
//! rest: D g(v) g(l) / (pi G) with G, the mean of g over the cosine-weighted hemisphere, has the albedo D g(v), and is reciprocal (the form of
//! Kelemen and Szirmay-Kalos, "A microfacet based coupled specular-matte BRDF model", 2001).

use super::albedo_table::{STEPS, TABLE};
use crate::simd::{LANES, Lanes, Simd, SimdBase, SimdFloat, f32x16, splat};

/// Means of a and b over the hemisphere, 4 times the integral of x^3 over x = sqrt(cos), for each row.
const MEANS: [[f32; 2]; STEPS + 1] = means();

/// Terms of the lobe at sixteen cosines.
#[derive(Clone, Copy)]
pub(super) struct LobeTerms<S: Simd> {
    pub scale: f32x16<S>,
    pub a: f32x16<S>,
    pub b: f32x16<S>,
}

/// The rows of sixteen alphas.
#[derive(Clone, Copy)]
pub(super) struct Rows<S: Simd>(f32x16<S>);

impl<S: Simd> Rows<S> {
    /// The rows of alphas in [0, 1].
    #[inline(always)]
    pub(super) fn of(simd: S, alpha: f32x16<S>) -> Self {
        Self(place(simd, alpha))
    }

    /// The terms at cosines in [0, 1], between the places of the table.
    #[inline(always)]
    pub(super) fn at(self, simd: S, cosine: f32x16<S>) -> LobeTerms<S> {
        let (rows, columns) = (self.0.to_array(), place(simd, cosine).to_array());
        let mut terms = [Lanes::ZERO; 3];
        for lane in 0..LANES {
            let (row, down) = split(rows[lane]);
            let (column, across) = split(columns[lane]);
            let (upper, lower) = (&TABLE[row], &TABLE[row + 1]);
            for (k, term) in terms.iter_mut().enumerate() {
                let first = upper[column][k] + across * (upper[column + 1][k] - upper[column][k]);
                let second = lower[column][k] + across * (lower[column + 1][k] - lower[column][k]);
                term.0[lane] = first + down * (second - first);
            }
        }
        LobeTerms { scale: terms[0].load(simd), a: terms[1].load(simd), b: terms[2].load(simd) }
    }

    /// Means of a and b.
    #[inline(always)]
    pub(super) fn means(self, simd: S) -> [f32x16<S>; 2] {
        let rows = self.0.to_array();
        let mut means = [Lanes::ZERO; 2];
        for lane in 0..LANES {
            let (row, down) = split(rows[lane]);
            for (k, mean) in means.iter_mut().enumerate() {
                mean.0[lane] = MEANS[row][k] + down * (MEANS[row + 1][k] - MEANS[row][k]);
            }
        }
        [means[0].load(simd), means[1].load(simd)]
    }
}

/// Places of numbers in [0, 1] in the table, whose steps are even in their square roots.
#[inline(always)]
fn place<S: Simd>(simd: S, number: f32x16<S>) -> f32x16<S> {
    number.max(splat(simd, 0.0)).min(splat(simd, 1.0)).sqrt() * splat(simd, STEPS as f32)
}

/// The step below a place, and the way to the next one.
#[inline(always)]
fn split(place: f32) -> (usize, f32) {
    let step = (place as usize).min(STEPS - 1);
    (step, place - step as f32)
}

const fn means() -> [[f32; 2]; STEPS + 1] {
    let mut means = [[0.0; 2]; STEPS + 1];
    let mut row = 0;
    while row <= STEPS {
        let mut column = 0;
        while column <= STEPS {
            let weight = weight_of(column);
            means[row][0] += weight * TABLE[row][column][1];
            means[row][1] += weight * TABLE[row][column][2];
            column += 1;
        }
        row += 1;
    }
    means
}

/// 4 times the integral of x^3 over the hat function of a column, which rises from the column before and falls to the next one.
const fn weight_of(column: usize) -> f32 {
    let to_fourth = 1.0 / (STEPS * STEPS * STEPS * STEPS) as f32;
    let up = if column > 0 { rising_side(column as f32) } else { 0.0 };
    let down = if column < STEPS {
        let next = (column + 1) as f32;
        let k = column as f32;
        next * next * next * next - k * k * k * k - rising_side(next)
    } else {
        0.0
    };
    (up + down) * to_fourth
}

/// 4 times the integral of x^3 (x - k + 1) from k - 1 to k.
const fn rising_side(k: f32) -> f32 {
    let j = k - 1.0;
    let (k4, j4) = (k * k * k * k, j * j * j * j);
    0.8 * (k4 * k - j4 * j) - j * (k4 - j4)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integrals of f1 cos x over directions, for x = s(l), 1, c and c s(l), from the viewer's cosine: the mean of f1 cos / p over
    /// mirrored directions at visible half vectors, in double precision.
    fn integrals(cosine: f64, alpha: f64, scale: impl Fn(f64) -> f64) -> [f64; 4] {
        const COUNT: usize = 96;
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let length = (alpha * sine).hypot(cosine);
        let (x, z) = (alpha * sine / length, cosine / length);
        let square = alpha * alpha;
        let smith = |cosine: f64| (square + (1.0 - square) * cosine * cosine).sqrt();
        let mut sums = [0.0; 4];
        for i in 0..COUNT * COUNT {
            let number = |k: usize| (k as f64 + 0.5) / COUNT as f64;
            let angle = number(i % COUNT) * std::f64::consts::PI;
            let height = (1.0 - number(i / COUNT)) * (1.0 + z) - z;
            let radius = (1.0 - height * height).max(0.0).sqrt();
            let half = glam::DVec3::new(
                (radius * libm::cos(angle) + x) * alpha,
                radius * libm::sin(angle) * alpha,
                height + z,
            );
            let half = half.normalize();
            let along = sine * half.x + cosine * half.z;
            let light = 2.0 * along * half.z - cosine;
            if light <= 0.0 {
                continue;
            }
            let (of_viewer, of_light) = (smith(cosine), smith(light));
            let weight = light * (cosine + of_viewer) / (light * of_viewer + cosine * of_light);
            let edge = libm::pow(1.0 - along.min(1.0), 5.0);
            let factors = [scale(light), 1.0, edge, edge * scale(light)];
            for (sum, factor) in sums.iter_mut().zip(factors) {
                *sum += weight * factor / (COUNT * COUNT) as f64;
            }
        }
        sums
    }

    #[test]
    fn the_table_holds_the_integrals() {
        for (row, terms) in TABLE.iter().enumerate() {
            let root = |step: usize| step as f64 / STEPS as f64;
            let alpha = root(row) * root(row);
            let scale = |cosine: f64| {
                let (column, across) = split((cosine.sqrt() * STEPS as f64) as f32);
                let [low, high] = [column, column + 1].map(|at| f64::from(terms[at][0]));
                low + f64::from(across) * (high - low)
            };
            for (column, found) in terms.iter().enumerate().step_by(2) {
                let cosine = (root(column) * root(column)).max(1e-4);
                let [s, a, b] = found.map(f64::from);
                if row == 0 {
                    let edge = libm::pow(1.0 - cosine, 5.0);
                    assert!(s == 1.0 && (a - (1.0 - edge)).abs() < 1e-3 && b == 0.0);
                    continue;
                }
                let [scaled, all, edge, scaled_edge] = integrals(cosine, alpha, scale);
                let expected = [1.0 / scaled, 1.0 - edge, 1.0 - all - (s * scaled_edge - edge)];
                for (found, expected) in [s, a, b].into_iter().zip(expected) {
                    assert!((found - expected).abs() < 4e-3, "{alpha} {cosine}: {found}, not {expected}");
                }
            }
        }
    }

    #[test]
    fn means_weigh_columns_by_their_solid_angles() {
        let total: f32 = (0..=STEPS).map(weight_of).sum();
        assert!((total - 1.0).abs() < 1e-5, "{total}");
        // Without roughness a is 1 - (1 - cos)^5, whose cosine-weighted mean is 1 - 2 / 42.
        assert!((MEANS[0][0] - (1.0 - 2.0 / 42.0)).abs() < 2e-3, "{}", MEANS[0][0]);
    }
}
