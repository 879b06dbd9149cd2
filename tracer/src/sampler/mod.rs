//! Random numbers of the path integrator: pure functions of pixel, sample, dimension and seed.
//!
//! A *dimension* is one use of two numbers, such as the direction of the third bounce. The samples of a pixel are numbered from 0, and
//! the pairs of one dimension are spread evenly over the unit square. Different dimensions, and different pixels, have nothing to do with
//! each other.
//!
//! ```text
//!   hash        seeds
//!   sobol       Owen-scrambled Sobol pairs
//!   dimension   the uses of numbers along a path
//! ```

mod dimension;
mod hash;
mod sobol;

pub(crate) use dimension::{Dimension, Vertex};
pub(crate) use hash::pixel_seed;

use crate::scene::Sampler;
use crate::simd::{Simd, SimdBase, f32x16, splat, u32x16};

/// Step of numbers: they are multiples of it in [0, 1), exact in `f32`.
const STEP: f32 = 1.0 / (1 << 24) as f32;

/// The two numbers in [0, 1) of sixteen samples in one dimension. `seeds` are those of [`pixel_seed`], `numbers` the numbers of the
/// samples in their pixels.
#[inline(always)]
pub(crate) fn pair<S: Simd>(
    simd: S,
    sampler: Sampler,
    seeds: u32x16<S>,
    numbers: u32x16<S>,
    dimension: Dimension,
) -> [f32x16<S>; 2] {
    let seeds = hash::mixed(simd, seeds ^ u32x16::splat(simd, dimension.salt()));
    let [x, y] = match sampler {
        Sampler::Sobol => sobol::pair(simd, numbers, seeds),
        Sampler::Independent => {
            let x = hash::mixed(simd, seeds ^ hash::mixed(simd, numbers));
            [x, hash::mixed(simd, x ^ u32x16::splat(simd, hash::SECOND))]
        }
    };
    [to_unit(simd, x), to_unit(simd, y)]
}

/// The upper 24 bits as a number in [0, 1).
#[inline(always)]
fn to_unit<S: Simd>(simd: S, bits: u32x16<S>) -> f32x16<S> {
    simd.cvt_f32_u32x16(bits >> 8) * splat(simd, STEP)
}

/// [`pair`] of one sample.
pub(crate) fn pair_of(sampler: Sampler, seed: u32, number: u32, dimension: Dimension) -> [f32; 2] {
    let seed = hash::mixed_one(seed ^ dimension.salt());
    let pair = match sampler {
        Sampler::Sobol => sobol::pair_of(number, seed),
        Sampler::Independent => {
            let x = hash::mixed_one(seed ^ hash::mixed_one(number));
            [x, hash::mixed_one(x ^ hash::SECOND)]
        }
    };
    pair.map(|bits| (bits >> 8) as f32 * STEP)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::simd::{LANES, all, dispatch};

    #[inline(always)]
    fn lanes<S: Simd>(
        simd: S,
        sampler: Sampler,
        seeds: [u32; LANES],
        numbers: [u32; LANES],
        dimension: Dimension,
    ) -> [[f32; LANES]; 2] {
        let (seeds, numbers) = (u32x16::load_array(simd, seeds), u32x16::load_array(simd, numbers));
        pair(simd, sampler, seeds, numbers, dimension).map(|number| number.to_array())
    }

    proptest! {
        #[test]
        fn lanes_have_the_numbers_of_single_samples_on_every_level(
            seeds in prop::array::uniform16(any::<u32>()), numbers in prop::array::uniform16(0_u32..70_000),
            bounce in 0_u32..64, independent: bool,
        ) {
            let sampler = if independent { Sampler::Independent } else { Sampler::Sobol };
            let dimension = Dimension::of(bounce, Vertex::Direction);
            for level in all() {
                let pairs = dispatch!(level, simd => lanes(simd, sampler, seeds, numbers, dimension));
                for lane in 0..LANES {
                    let one = pair_of(sampler, seeds[lane], numbers[lane], dimension);
                    prop_assert_eq!([pairs[0][lane], pairs[1][lane]], one);
                    prop_assert!(one.iter().all(|number| (0.0..1.0).contains(number)));
                }
            }
        }
    }

    /// The pairs of the first samples of a pixel.
    fn pairs(sampler: Sampler, seed: u32, count: u32, dimension: Dimension) -> Vec<[f32; 2]> {
        (0..count).map(|number| pair_of(sampler, seed, number, dimension)).collect()
    }

    #[test]
    fn every_cell_of_every_grid_has_one_of_2_to_the_n_pairs() {
        for seed in [1, 77, 0xdead_beef] {
            let pairs = pairs(Sampler::Sobol, seed, 64, Dimension::LENS);
            for columns in [1_usize, 2, 4, 8, 16, 32, 64] {
                let rows = 64 / columns;
                let mut cells = vec![0; 64];
                for [x, y] in &pairs {
                    cells[(x * columns as f32) as usize + columns * (y * rows as f32) as usize] += 1;
                }
                assert_eq!(cells, vec![1; 64], "{columns} x {rows} cells, seed {seed}");
            }
        }
    }

    #[test]
    fn dimensions_and_pixels_are_independent() {
        let mean_product = |a: &[[f32; 2]], b: &[[f32; 2]]| {
            let centred = |pair: &[f32; 2]| pair.map(|number| f64::from(number) - 0.5);
            let products = a.iter().zip(b).map(|(a, b)| centred(a)[0] * centred(b)[0]);
            products.sum::<f64>() / a.len() as f64
        };
        // The standard deviation of the mean of n products of two independent numbers is 1 / (12 sqrt(n)).
        let allowed = 5.0 / (12.0 * 4096_f64.sqrt());
        for sampler in [Sampler::Sobol, Sampler::Independent] {
            let first = pairs(sampler, pixel_seed(3, 4, 0), 4096, Dimension::of(0, Vertex::Direction));
            for other in [
                pairs(sampler, pixel_seed(3, 4, 0), 4096, Dimension::of(1, Vertex::Direction)),
                pairs(sampler, pixel_seed(3, 4, 0), 4096, Dimension::of(0, Vertex::LightPoint)),
                pairs(sampler, pixel_seed(4, 4, 0), 4096, Dimension::of(0, Vertex::Direction)),
                pairs(sampler, pixel_seed(3, 4, 1), 4096, Dimension::of(0, Vertex::Direction)),
            ] {
                let found = mean_product(&first, &other);
                assert!(found.abs() < allowed, "{sampler:?}: {found}");
            }
        }
    }

    #[test]
    fn sobol_pairs_integrate_better_than_independent_ones() {
        // The integral of (x^2 + y) over the unit square is 5/6; the error of its estimate by 256 pairs.
        let error = |sampler| {
            let squares = (0..64).map(|seed| {
                let pairs = pairs(sampler, pixel_seed(seed, 9, 0), 256, Dimension::PIXEL);
                let values = pairs.iter().map(|[x, y]| f64::from(x * x + y));
                (values.sum::<f64>() / 256.0 - 5.0 / 6.0).powi(2)
            });
            (squares.sum::<f64>() / 64.0).sqrt()
        };
        assert!(error(Sampler::Sobol) * 20.0 < error(Sampler::Independent));
    }
}
