//! Sobol pairs with Owen scrambling by hashes (Burley, "Practical Hash-based Owen Scrambling", 2020).
//!
//! The order of the samples is scrambled too, so that dimensions are independent and any first 2^n samples are well spread. Sobol's
//! first dimension reverses the bits of the sample's number. The second one first multiplies them by Pascal's triangle modulo 2, which
//! five shifts do. Owen's scrambling of a number is a hash, in which a bit depends on lower ones only, of its reversed bits.

use super::hash::{SECOND, mixed, mixed_one};
use crate::simd::{Simd, SimdBase, u32x16};

/// The pair of sixteen samples, as fractions of 2^32.
#[inline(always)]
pub(super) fn pair<S: Simd>(simd: S, numbers: u32x16<S>, seeds: u32x16<S>) -> [u32x16<S>; 2] {
    let first = scrambled(simd, reversed(simd, numbers), seeds);
    let index = reversed(simd, first);
    let seeds_x = mixed(simd, seeds);
    let seeds_y = mixed(simd, seeds ^ u32x16::splat(simd, SECOND));
    [
        reversed(simd, scrambled(simd, index, seeds_x)),
        reversed(simd, scrambled(simd, pascal(simd, index), seeds_y)),
    ]
}

/// [`pair`] of one sample.
pub(super) fn pair_of(number: u32, seed: u32) -> [u32; 2] {
    let index = scrambled_one(number.reverse_bits(), seed).reverse_bits();
    [
        scrambled_one(index, mixed_one(seed)).reverse_bits(),
        scrambled_one(pascal_one(index), mixed_one(seed ^ SECOND)).reverse_bits(),
    ]
}

/// The hash of Laine and Karras, as Burley improved it: each bit depends on itself and lower ones.
#[inline(always)]
fn scrambled<S: Simd>(simd: S, x: u32x16<S>, seeds: u32x16<S>) -> u32x16<S> {
    let x = x ^ (x * 0x3d20_adea);
    let x = x + seeds;
    let x = x * ((seeds >> 16) | u32x16::splat(simd, 1));
    let x = x ^ (x * 0x0552_6c56);
    x ^ (x * 0x53a2_2864)
}

fn scrambled_one(x: u32, seed: u32) -> u32 {
    let x = x ^ x.wrapping_mul(0x3d20_adea);
    let x = x.wrapping_add(seed);
    let x = x.wrapping_mul(seed >> 16 | 1);
    let x = x ^ x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Steps of the product with Pascal's triangle: bits that move down, and by how much.
const PASCAL: [(u32, u32); 5] =
    [(0xaaaa_aaaa, 1), (0xcccc_cccc, 2), (0xf0f0_f0f0, 4), (0xff00_ff00, 8), (0xffff_0000, 16)];

#[inline(always)]
fn pascal<S: Simd>(simd: S, mut x: u32x16<S>) -> u32x16<S> {
    for (moved, by) in PASCAL {
        x = x ^ ((x & u32x16::splat(simd, moved)) >> by);
    }
    x
}

fn pascal_one(x: u32) -> u32 {
    PASCAL.iter().fold(x, |x, (moved, by)| x ^ (x & moved) >> by)
}

/// The bits in reverse order.
#[inline(always)]
fn reversed<S: Simd>(simd: S, mut x: u32x16<S>) -> u32x16<S> {
    for (mask, by) in [(0x5555_5555, 1), (0x3333_3333, 2), (0x0f0f_0f0f, 4), (0x00ff_00ff, 8)] {
        let mask = u32x16::splat(simd, mask);
        x = ((x >> by) & mask) | ((x & mask) << by);
    }
    (x >> 16) | (x << 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_dimension_is_that_of_sobol() {
        // Sobol's direction numbers of the second dimension: m = 1, 3, 5, 15, 17, 51, 85, 255 over 2, 4, 8, ...
        let numbers = [1_u32, 3, 5, 15, 17, 51, 85, 255];
        for index in 0..256_u32 {
            let expected = numbers
                .iter()
                .enumerate()
                .fold(0, |sum, (bit, m)| if index >> bit & 1 == 1 { sum ^ m << (31 - bit) } else { sum });
            assert_eq!(pascal_one(index).reverse_bits(), expected, "{index}");
        }
    }

    #[test]
    fn scrambling_permutes_and_keeps_lower_bits_to_themselves() {
        for bits in 1..=10 {
            let mut seen = vec![false; 1 << bits];
            (0..1_u32 << bits)
                .for_each(|x| seen[(scrambled_one(x, 0x9e37_79b9) & ((1 << bits) - 1)) as usize] = true);
            assert!(seen.into_iter().all(|seen| seen), "{bits} bits");
        }
    }
}
