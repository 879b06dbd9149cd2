//! A denoiser: the edge-avoiding a-trous wavelet filter of Dammertz, Sewtz, Hanika and Lensch, "Edge-avoiding a-trous wavelet
//! transform for fast global illumination filtering", HPG 2010, scaled by an estimate of the noise as in Schied et al.,
//! "Spatiotemporal variance-guided filtering", HPG 2017.
//!
//! ```text
//!   guides    albedo, normals and depth of the pixels
//!   estimate  light without the albedo, and its variance from the two halves of the samples
//!   level     one level of the filter: 25 taps, 2^level pixels apart
//!   weights   weights of a tap by light, normal and depth
//! ```
//!
//! The mean of a pixel is divided by its albedo, filtered in five levels, and multiplied by its albedo again, so that textures stay sharp.
//! A pixel of the result is a function of the inputs alone: the taps are added in a fixed order, by + - * / and comparisons. With more
//! samples the estimate of the noise falls, and the result converges to the picture itself.
//!
//! Limits: the guides have one ray through the centre of each pixel, and see the first surface. Edges of objects are as they are in the
//! guides, without antialiasing where the picture is noisy; what mirrors and glass show, and what a lens or a moving object blurs, is
//! separated by its light alone.

mod estimate;
mod guides;
mod level;
#[cfg(test)]
mod tests;
mod weights;

use super::PixelSums;
use crate::image::ImageError;
use estimate::Estimate;
pub use guides::{GUIDES, Guides};

/// Levels of the filter: the outermost taps of the last one are 32 pixels apart from the pixel.
const LEVELS: u32 = 5;

/// Means of the pixels of a picture without most of their noise, linear RGB, rows from top to bottom.
///
/// `sums` are those of `samples` samples of each pixel of the picture of the guides. With fewer than two samples there is no estimate of
/// the noise, and the means are returned as they are.
///
/// # Errors
/// Another number of sums than the guides have pixels.
pub fn denoise(sums: &[PixelSums], samples: u32, guides: &Guides) -> Result<Vec<[f32; 3]>, ImageError> {
    guides.check(sums.len())?;
    let mut estimates = estimate::of_picture(sums, samples, guides);
    for level in 0..LEVELS {
        estimates = level::filtered(&estimates, guides, 1 << level);
    }
    let light = |(estimate, guide): (&Estimate, &guides::Guide)| {
        [0, 1, 2].map(|channel| estimate.light[channel] * guide.albedo[channel])
    };
    Ok(estimates.iter().zip(guides.pixels()).map(light).collect())
}
