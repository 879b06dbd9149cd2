//! Estimates of the light in each pixel, and of their noise.

use rayon::prelude::*;

use super::guides::{Guide, Guides};
use super::level;
use crate::film::PixelSums;

/// An estimate of the light in a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    /// Mean radiance, divided by the albedo.
    pub light: [f32; 3],
    /// Variance of the mean of the three channels of `light`.
    pub variance: f32,
}

/// The estimates of a picture. The variance of a pixel is that of the picture around it, as an estimate from two halves has one degree of
/// freedom only.
pub(super) fn of_picture(sums: &[PixelSums], samples: u32, guides: &Guides) -> Vec<Estimate> {
    let own = sums.par_iter().zip(guides.pixels()).map(|(sums, guide)| of_pixel(sums, samples, guide));
    let own: Vec<Estimate> = own.collect();
    level::with_smooth_variance(&own, guides)
}

/// The estimate of a pixel alone. With e the mean of red, green and blue, added, over the n_e samples with an even number, and o that over
/// the n_o others, the mean m of all n samples has the variance
///
/// ```text
/// Var(m) = n_e n_o / n^2 (e - o)^2
/// ```
///
/// The light without the albedo has the same relative error. The variance is 0 with fewer than two samples.
fn of_pixel(sums: &PixelSums, samples: u32, guide: &Guide) -> Estimate {
    let mean = sums.mean(samples);
    let light = [0, 1, 2].map(|channel| mean[channel] / guide.albedo[channel]);
    let (even, odd) = (f64::from(samples.div_ceil(2)), f64::from(samples / 2));
    let all = sums.rgb.iter().map(|sum| *sum as f64).sum::<f64>();
    if odd == 0.0 || all == 0.0 {
        return Estimate { light, variance: 0.0 };
    }
    let of_even = sums.even as f64;
    let difference = of_even / even - (all - of_even) / odd;
    let samples = f64::from(samples);
    let relative = difference / (all / samples);
    let brightness = f64::from(light[0] + light[1] + light[2]) / 3.0;
    let variance = even * odd / (samples * samples) * relative * relative * brightness * brightness;
    Estimate { light, variance: variance as f32 }
}
