//! Powers of cosines without logarithms: the first terms of the binomial series of a root, then repeated squaring.
//!
//! ```text
//! cos^p = (1 - t)^(p / 2)  with t = sin^2
//!       = ((1 - t)^q)^n    with n = 2^k, q = p / (2 n)
//!       ~ (1 - q t + q (q - 1) / 2 t^2)^n
//! ```
//!
//! The n-th power takes k squarings. The truncation error is multiplied by n, but where t is not small the power vanishes: with
//! a = q n t the error is about a^3 e^-a |(q - 1) (q - 2)| / (6 q^2 n^2), at most 0.03 / n^2 for q in [1, 2], and n >= 4.

use crate::simd::{Simd, SimdBase, f32x16, splat};

/// Least exponent: smaller ones have larger errors.
pub(super) const LEAST_EXPONENT: f32 = 8.0;

/// Error bound for exponents from [`LEAST_EXPONENT`]: half a step of an 8-bit picture, and less in the mean.
#[cfg(test)]
const MAX_ERROR: f32 = 0.0021;

/// Largest k: rounding errors are multiplied by n, too.
const MOST_SQUARINGS: u32 = 8;

/// cos^exponent for squared sines in [0, 1], or slightly above.
#[inline(always)]
pub(super) fn power<S: Simd>(simd: S, sine_square: f32x16<S>, exponent: f32) -> f32x16<S> {
    let half = 0.5 * exponent;
    // The binary exponent: the largest k with 2^k <= half.
    let squarings = (half.to_bits() >> 23).saturating_sub(127).min(MOST_SQUARINGS);
    let q = half / (1_u32 << squarings) as f32;
    let curve = splat(simd, (q - 1.0) / (2.0 * q));
    // Beyond its vertex the parabola rises again, where the power is zero.
    let vertex = splat(simd, q / (q - 1.0));
    let x = (sine_square * splat(simd, q)).min(vertex);
    let one = splat(simd, 1.0);
    let mut power = one - x * (one - x * curve);
    for _ in 0..squarings {
        power = power * power;
    }
    power
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{LANES, all, dispatch};

    #[inline(always)]
    fn apply<S: Simd>(simd: S, t: [f32; LANES], exponent: f32) -> [f32; LANES] {
        power(simd, f32x16::load_array(simd, t), exponent).min(splat(simd, 2.0)).to_array()
    }

    /// Exponents from 8 to 10^6, a step of 0.7 % apart and where q changes, at squared sines from 0 to 1 whose powers spread evenly.
    #[test]
    fn the_error_is_bounded_and_the_bits_are_the_same_on_every_level() {
        let spread = (0..).map(|i| LEAST_EXPONENT * libm::powf(1.007, i as f32)).take_while(|p| *p < 1e6);
        let edges = (4..20).flat_map(|k| [-1e-3, 0.0, 1e-3].map(|by| (1 << k) as f32 * (1.0 + by)));
        let mut worst = (0.0, 0.0, 0.0);
        for exponent in spread.chain(edges).chain([1e6]) {
            for part in 0..40 {
                let t: [f32; LANES] = std::array::from_fn(|lane| {
                    let a = (part * LANES + lane) as f32 / 20.0;
                    (a / (0.5 * exponent)).min(1.0)
                });
                let first = dispatch!(all()[0], simd => apply(simd, t, exponent));
                for level in all() {
                    let here = dispatch!(level, simd => apply(simd, t, exponent));
                    assert_eq!(here.map(f32::to_bits), first.map(f32::to_bits), "{exponent} at {t:?}");
                }
                for (t, power) in t.into_iter().zip(first) {
                    let exact = libm::pow(1.0 - f64::from(t), f64::from(exponent) / 2.0);
                    let error = (f64::from(power) - exact).abs();
                    if !(error <= worst.0) {
                        worst = (error, exponent, t);
                    }
                }
            }
        }
        assert!(worst.0 < f64::from(MAX_ERROR), "off by {} for exponent {} at {}", worst.0, worst.1, worst.2);
    }
}
