//! Estimate of the error of a picture from two halves of its samples.

use rayfarm_tracer::PixelSums;

/// Steps of a sum per unit of radiance: see [`PixelSums`].
const STEPS: f64 = (1 << 20) as f64;

/// Least mean of a picture, red, green and blue added, to which its error is related: the error of a black picture is absolute.
const LEAST_MEAN: f64 = 3e-3;

/// Estimate of the relative error of a picture of n samples; `None` for fewer than two.
///
/// With e the mean of red, green and blue, added, over the samples of a pixel with an even number, o that over the others, and n_e and n_o
/// the numbers of these samples,
///
/// ```text
/// E = sqrt(n_e n_o) / n * sqrt(mean over pixels of (e - o)^2) / max(mean over pixels and samples of r + g + b, 0.003)
/// ```
///
/// Independent samples of variance v have Var(e - o) = v n / (n_e n_o), and their mean has the variance v / n: the first factor (1/2 for
/// equal halves) is the square root of the ratio. E is thus the standard deviation of a pixel, as the root of its mean square over the
/// picture, in parts of the mean brightness. Samples that are spread evenly (Owen-scrambled Sobol points) are better together than their
/// halves show, so E is too high for them rather than too low.
///
/// The numbers are added in the order of pixels: the estimate is a function of the sums, bit for bit.
pub(super) fn relative_error(sums: &[PixelSums], samples: u32) -> Option<f64> {
    let (even, odd) = (f64::from(samples.div_ceil(2)), f64::from(samples / 2));
    if odd == 0.0 || sums.is_empty() {
        return None;
    }
    let (mut squares, mut total) = (0.0, 0.0);
    for pixel in sums {
        let all = pixel.rgb.iter().map(|sum| *sum as f64).sum::<f64>() / STEPS;
        let of_even = pixel.even as f64 / STEPS;
        let difference = of_even / even - (all - of_even) / odd;
        squares += difference * difference;
        total += all;
    }
    let (pixels, samples) = (sums.len() as f64, f64::from(samples));
    let of_whole = (even * odd).sqrt() / samples;
    Some(of_whole * (squares / pixels).sqrt() / (total / (pixels * samples)).max(LEAST_MEAN))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers from 0 to 1, by a linear congruential generator (Knuth's MMIX).
    struct Noise(u64);

    impl Noise {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / (1 << 24) as f32
        }
    }

    /// Sums of samples of `level` plus or minus up to `spread` in each channel, the same in all three.
    fn noisy(pixels: usize, samples: u32, level: f32, spread: f32) -> Vec<PixelSums> {
        let mut noise = Noise(9);
        let pixel = |_| {
            let mut sums = PixelSums::default();
            for number in 0..samples {
                let value = level + spread * (2.0 * noise.next() - 1.0);
                sums.add_sample(number, PixelSums::steps([value; 3]));
            }
            sums
        };
        (0..pixels).map(pixel).collect()
    }

    #[test]
    fn the_estimate_is_the_standard_deviation_of_the_means() {
        // A uniform distribution from -a to a has the variance a^2 / 3.
        for (samples, level, spread) in
            [(2, 0.5, 0.3), (3, 0.5, 0.3), (16, 2.0, 1.5), (17, 0.25, 0.25), (64, 8.0, 0.5)]
        {
            let expected = f64::from(spread) / (3.0 * f64::from(samples)).sqrt() / f64::from(level);
            let estimate = relative_error(&noisy(20_000, samples, level, spread), samples).unwrap();
            // 20,000 squares of about Gaussian numbers: their root mean square is within 0.5 %, six of which are allowed, and the mean
            // brightness is closer.
            assert!(
                (estimate / expected - 1.0).abs() < 0.03,
                "{samples} samples: {estimate}, expected {expected}"
            );
        }
    }

    #[test]
    fn it_is_the_error_against_the_true_picture() {
        let (samples, level, spread) = (8, 0.7, 0.6);
        let sums = noisy(20_000, samples, level, spread);
        let square = |sums: &PixelSums| f64::from(sums.mean(samples)[0] - level).powi(2);
        let rmse = (sums.iter().map(square).sum::<f64>() / sums.len() as f64).sqrt();
        let estimate = relative_error(&sums, samples).unwrap();
        assert!((estimate * f64::from(level) / rmse - 1.0).abs() < 0.03, "{estimate}, and RMSE {rmse}");
    }

    #[test]
    fn samples_without_noise_have_no_error_and_one_sample_has_no_estimate() {
        assert_eq!(relative_error(&noisy(50, 16, 0.5, 0.0), 16), Some(0.0));
        assert_eq!(relative_error(&noisy(50, 16, 0.0, 0.0), 16), Some(0.0));
        assert_eq!(relative_error(&noisy(50, 1, 0.5, 0.3), 1), None);
        assert_eq!(relative_error(&[], 16), None);
    }

    #[test]
    fn a_dark_picture_has_an_absolute_error() {
        let mut sums = vec![PixelSums::default(); 100];
        sums[0].add_sample(0, PixelSums::steps([0.01; 3]));
        // One pixel of a hundred differs by 0.03: the root of the mean square is 0.003.
        let estimate = relative_error(&sums, 2).unwrap();
        assert!((estimate - 0.5 * 0.003 / 3e-3).abs() < 1e-3, "{estimate}");
    }
}
