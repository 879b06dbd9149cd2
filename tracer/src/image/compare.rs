//! Numerical differences of two pictures.

use super::{ImageError, RgbImage, ssim};

/// The difference of two pictures of one size, over their sRGB bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Largest difference of a channel.
    pub max: u8,
    /// Number of pixels that differ in any channel.
    pub differing_pixels: usize,
    /// Root of the mean squared difference over all channels, 0..255.
    pub rmse: f64,
    /// Peak signal to noise ratio in decibels: 20 log10(255 / rmse); infinite for equal pictures.
    pub psnr: f64,
    /// Mean structural similarity of the luma, -1..1; 1 for equal pictures.
    /// Wang, Bovik, Sheikh, Simoncelli: "Image Quality Assessment", 2004, with its window and constants.
    pub ssim: f64,
}

/// Compares two pictures of one size. Two empty pictures are equal.
///
/// # Errors
/// Pictures of different sizes, or whose buffers do not fit their sizes.
pub fn compare(a: &RgbImage, b: &RgbImage) -> Result<Difference, ImageError> {
    a.check_against(b)?;
    let bytes = || a.pixels.iter().zip(&b.pixels).map(|(a, b)| a.abs_diff(*b));
    let squares: u64 = bytes().map(|d| u64::from(d) * u64::from(d)).sum();
    let rmse = (squares as f64 / a.pixels.len().max(1) as f64).sqrt();
    Ok(Difference {
        max: bytes().max().unwrap_or(0),
        differing_pixels: a.pixels.chunks(3).zip(b.pixels.chunks(3)).filter(|(a, b)| a != b).count(),
        rmse,
        psnr: 20.0 * (255.0 / rmse).log10(),
        ssim: ssim::mean(a, b),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(width: u32, height: u32, seed: u32) -> RgbImage {
        let mut state = seed;
        let mut image = RgbImage::new(width, height);
        for byte in &mut image.pixels {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *byte = (state >> 24) as u8;
        }
        image
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        for (width, height) in [(0, 0), (1, 1), (3, 40), (33, 17)] {
            let image = noise(width, height, 1);
            let d = compare(&image, &image).unwrap();
            assert_eq!((d.max, d.differing_pixels, d.rmse, d.psnr), (0, 0, 0.0, f64::INFINITY));
            assert!((d.ssim - 1.0).abs() < 1e-12, "{d:?}");
        }
    }

    #[test]
    fn one_changed_channel_is_counted_once() {
        let a = RgbImage::new(10, 10);
        let mut b = a.clone();
        b.pixels[31] = 30;
        let d = compare(&a, &b).unwrap();
        assert_eq!((d.max, d.differing_pixels), (30, 1));
        // 30^2 over 300 channels has the mean 3.
        assert!((d.rmse - 3f64.sqrt()).abs() < 1e-12, "{d:?}");
        assert!((d.psnr - 20.0 * (255.0 / 3f64.sqrt()).log10()).abs() < 1e-9, "{d:?}");
    }

    #[test]
    fn structure_counts_more_than_brightness() {
        let a = noise(40, 40, 7);
        let mut brighter = a.clone();
        brighter.pixels.iter_mut().for_each(|byte| *byte = byte.saturating_add(12));
        let brighter = compare(&a, &brighter).unwrap().ssim;
        let other = compare(&a, &noise(40, 40, 8)).unwrap().ssim;
        assert!(brighter > 0.95, "{brighter}");
        assert!(other < 0.2, "{other}");
    }

    #[test]
    fn ssim_of_flat_pictures_follows_its_formula() {
        let (mut a, mut b) = (RgbImage::new(20, 20), RgbImage::new(20, 20));
        a.pixels.fill(100);
        b.pixels.fill(150);
        // Without variance only the luminance term remains: (2 m n + C1) / (m^2 + n^2 + C1).
        let c1 = (0.01f64 * 255.0).powi(2);
        let expected = (2.0 * 100.0 * 150.0 + c1) / (100.0f64.powi(2) + 150.0f64.powi(2) + c1);
        let d = compare(&a, &b).unwrap();
        assert!((d.ssim - expected).abs() < 1e-9, "{} {expected}", d.ssim);
    }

    #[test]
    fn different_sizes_are_refused_with_both() {
        let message = compare(&RgbImage::new(2, 3), &RgbImage::new(3, 2)).unwrap_err().to_string();
        assert!(message.contains("2 x 3") && message.contains("3 x 2"), "{message}");
    }
}
