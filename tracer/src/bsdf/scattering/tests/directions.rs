//! Directions that follow their density.

use super::{Seen, at, back, eval, metallic_roughness, rough, sample, seen, turned};
use crate::simd::{LANES, best, three};

/// Number of bins of the cosine, and of the angle around.
const BINS: [usize; 2] = [24, 24];

/// Expected numbers of samples in bins of equal solid angle above the surface, of `count` in all.
fn expected(seen: &Seen, count: usize) -> Vec<f64> {
    const FINE: usize = 12;
    let mut bins = vec![0.0; BINS[0] * BINS[1]];
    let (rows, columns) = (BINS[0] * FINE, BINS[1] * FINE);
    for row in 0..rows {
        for column in 0..columns {
            let cosine = (row as f64 + 0.5) / rows as f64;
            let turn = (column as f64 + 0.5) / columns as f64 * std::f64::consts::TAU;
            let [_, density] = eval(seen, turned(at(cosine, turn)));
            let solid_angle = std::f64::consts::TAU / (rows * columns) as f64;
            bins[row / FINE * BINS[1] + column / FINE] += density * solid_angle * count as f64;
        }
    }
    bins
}

/// Pseudo-random numbers in [0, 1): splitmix64.
fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
}

/// Chi-square of the directions of independent samples. The bound is that of p = 1e-4 by Wilson and Hilferty's approximation.
#[test]
fn directions_follow_their_density() {
    let plain = rough().into_iter().map(|material| (material, [1.0; 2]));
    let textured =
        [(metallic_roughness(1.0, 0.8, 0.0), [0.6, 0.4]), (metallic_roughness(0.7, 1.0, 0.0), [0.35, 1.0])];
    for (material, factors) in plain.chain(textured) {
        for cosine in [0.95, 0.35] {
            let seen = Seen { factors, ..seen(material, cosine, 1.0) };
            let (blocks, mut state) = (4096, 7);
            let mut found = vec![0_u32; BINS[0] * BINS[1]];
            for _ in 0..blocks {
                let numbers = three!(_i => std::array::from_fn(|_| random(&mut state)));
                for sample in sample(best(), &seen, &numbers).iter().filter(|sample| sample.alive) {
                    let local = back(sample.direction);
                    if local.z > 0.0 {
                        let row = (local.z * BINS[0] as f64) as usize;
                        let turn = libm::atan2(local.y, local.x) / std::f64::consts::TAU;
                        let column = ((turn - turn.floor()) * BINS[1] as f64) as usize;
                        let (row, column) = (row.min(BINS[0] - 1), column.min(BINS[1] - 1));
                        found[row * BINS[1] + column] += 1;
                    }
                }
            }
            let (mut sum, mut bins) = (0.0, 0.0_f64);
            let (mut rare, mut rare_found) = (0.0, 0.0);
            for (found, expected) in found.iter().zip(expected(&seen, blocks * LANES)) {
                if expected < 10.0_f64 {
                    rare += expected;
                    rare_found += f64::from(*found);
                    continue;
                }
                let difference = f64::from(*found) - expected;
                sum += difference * difference / expected;
                bins += 1.0;
            }
            if rare >= 10.0 {
                sum += (rare_found - rare) * (rare_found - rare) / rare;
                bins += 1.0;
            }
            let spread = 2.0 / (9.0 * bins);
            let bound = bins * f64::powi(1.0 - spread + 3.72 * spread.sqrt(), 3);
            assert!(bins > 20.0 && sum < bound, "{sum} over {bins} bins at {cosine}: {material:?}");
        }
    }
}
