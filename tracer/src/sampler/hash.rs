//! Hashes of whole numbers.

use crate::simd::{Simd, u32x16};

/// Salt of the second of two numbers.
pub(super) const SECOND: u32 = 0x68bc_21eb;

/// Seed of the samples of a pixel: the first number of pcg4d (Jarzynski and Olano, "Hash functions for GPU rendering", 2020).
pub(crate) fn pixel_seed(x: u32, y: u32, seed: u32) -> u32 {
    let step = |value: u32| value.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let [mut x, mut y, mut z, mut w] = [step(x), step(y), step(seed), step(0)];
    let mut round = || {
        x = x.wrapping_add(y.wrapping_mul(w));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
        w = w.wrapping_add(y.wrapping_mul(z));
        [x, y, z, w] = [x, y, z, w].map(|value| value ^ value >> 16);
        x
    };
    round();
    round()
}

/// A hash in which every bit depends on every bit of the number: two rounds of multiplication and shift.
#[inline(always)]
pub(super) fn mixed<S: Simd>(_: S, x: u32x16<S>) -> u32x16<S> {
    let x = (x ^ (x >> 16)) * 0x7feb_352d;
    let x = (x ^ (x >> 15)) * 0x846c_a68b;
    x ^ (x >> 16)
}

/// [`mixed`] of one number.
pub(super) fn mixed_one(x: u32) -> u32 {
    let x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
    let x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn neighbours_have_different_seeds() {
        let seeds: BTreeSet<u32> = (0..64)
            .flat_map(|y| (0..64).flat_map(move |x| (0..4).map(move |s| pixel_seed(x, y, s))))
            .collect();
        // Of 16,384 numbers of 32 bits a few pairs are equal by chance.
        assert!(seeds.len() > 16_370, "{}", seeds.len());
    }

    #[test]
    fn one_bit_changes_half_of_the_bits() {
        let flipped: u32 = (0..32)
            .flat_map(|bit| {
                (0..64_u32)
                    .map(move |i| (mixed_one(i * 7919) ^ mixed_one((i * 7919) ^ (1 << bit))).count_ones())
            })
            .sum();
        let mean = f64::from(flipped) / (32.0 * 64.0);
        assert!((mean - 16.0).abs() < 0.5, "{mean}");
    }
}
