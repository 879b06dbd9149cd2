//! Exact sums of samples.
//!
//! The radiance of a sample is rounded to a multiple of 2^-20, so that sums are whole numbers: passes, segments, retries and threads add
//! up to the same bits in any order.

use crate::scene::PixelFormat;

/// Largest radiance of a sample in a channel; brighter samples count as this.
pub const MAX_RADIANCE: f32 = 1024.0;

/// Steps per unit of radiance.
const STEPS: f32 = (1 << 20) as f32;

/// Bytes of a number.
const NUMBER: usize = 6;

/// Bytes of a pixel.
const BYTES: usize = PixelFormat::Sums.bytes_per_pixel();

/// Sums of the samples of a pixel, in steps of 2^-20. 65,536 samples of the largest radiance stay below 2^48.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelSums {
    /// Red, green and blue of all samples.
    pub rgb: [u64; 3],
    /// Red, green and blue, added, of the samples with an even number. Compared with the rest it shows the noise.
    pub even: u64,
}

impl PixelSums {
    /// The radiance of a sample, in steps. Not a number counts as none.
    pub fn steps(radiance: [f32; 3]) -> [u32; 3] {
        radiance.map(|value| {
            // A NaN becomes 0.
            let bounded = if value > 0.0 { value.min(MAX_RADIANCE) } else { 0.0 };
            // Below 2^30, and exact: a power of two times an `f32`, rounded to a whole number.
            (bounded * STEPS).round_ties_even() as u32
        })
    }

    /// Adds the sample with a number, given in steps.
    pub fn add_sample(&mut self, number: u32, steps: [u32; 3]) {
        for (sum, steps) in self.rgb.iter_mut().zip(steps) {
            *sum += u64::from(steps);
        }
        if number.is_multiple_of(2) {
            self.even += steps.into_iter().map(u64::from).sum::<u64>();
        }
    }

    /// Adds the sums of other samples.
    pub fn add(&mut self, other: &Self) {
        for (sum, other) in self.rgb.iter_mut().zip(other.rgb) {
            *sum = sum.saturating_add(other);
        }
        self.even = self.even.saturating_add(other.even);
    }

    /// Mean radiance of a number of samples, linear RGB.
    pub fn mean(&self, samples: u32) -> [f32; 3] {
        let scale = 1.0 / (f64::from(samples.max(1)) * f64::from(STEPS));
        self.rgb.map(|sum| (sum as f64 * scale) as f32)
    }

    /// The numbers on the wire and in files, 48 bits each: red, green, blue, even.
    pub fn to_bytes(self) -> [u8; BYTES] {
        let mut bytes = [0; BYTES];
        let numbers = self.rgb.into_iter().chain([self.even]);
        for (to, number) in bytes.chunks_exact_mut(NUMBER).zip(numbers) {
            to.copy_from_slice(&number.to_le_bytes()[..NUMBER]);
        }
        bytes
    }

    /// The sums in these bytes. All bytes are valid.
    pub fn from_bytes(bytes: &[u8; BYTES]) -> Self {
        let number = |index: usize| {
            let mut wide = [0; 8];
            wide[..NUMBER].copy_from_slice(&bytes[index * NUMBER..(index + 1) * NUMBER]);
            u64::from_le_bytes(wide)
        };
        Self { rgb: [number(0), number(1), number(2)], even: number(3) }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn radiance_is_bounded_and_rounded() {
        assert_eq!(PixelSums::steps([0.0, 1.0, 0.5]), [0, 1 << 20, 1 << 19]);
        assert_eq!(PixelSums::steps([f32::NAN, f32::INFINITY, -3.0]), [0, 1 << 30, 0]);
        assert_eq!(PixelSums::steps([1025.0, 0.4 / STEPS, 0.6 / STEPS]), [1 << 30, 0, 1]);
    }

    #[test]
    fn the_brightest_sums_fit() {
        let mut sums = PixelSums::default();
        (0..65_536).for_each(|number| sums.add_sample(number, PixelSums::steps([MAX_RADIANCE; 3])));
        assert_eq!(PixelSums::from_bytes(&sums.to_bytes()), sums);
        assert_eq!(sums.mean(65_536), [MAX_RADIANCE; 3]);
        assert_eq!(sums.even, 3 * (1 << 30) * 32_768);
    }

    proptest! {
        #[test]
        fn samples_add_up_in_any_order_and_any_passes(
            samples in prop::collection::vec(prop::array::uniform3(-1.0_f32..2000.0), 1..40),
            cut in 0_usize..40,
        ) {
            let sum = |numbers: &mut dyn Iterator<Item = usize>| {
                let mut sums = PixelSums::default();
                numbers.for_each(|i| sums.add_sample(i as u32, PixelSums::steps(samples[i])));
                sums
            };
            let all = sum(&mut (0..samples.len()));
            let cut = cut.min(samples.len());
            let mut parts = sum(&mut (cut..samples.len()).rev());
            parts.add(&sum(&mut (0..cut)));
            prop_assert_eq!(parts, all);
            prop_assert_eq!(PixelSums::from_bytes(&all.to_bytes()), all);
        }
    }
}
