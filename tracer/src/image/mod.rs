//! Finished pictures: sRGB bytes in memory, comparison, resizing, and picture files.
//!
//! Picture files need the feature `pictures`.

mod compare;
mod error;
mod flip;
#[cfg(feature = "pictures")]
mod layers;
#[cfg(feature = "pictures")]
mod load;
mod reduced;
mod resize;
#[cfg(feature = "pictures")]
mod save;
#[cfg(feature = "pictures")]
mod sky;
mod ssim;

pub use compare::{Difference, compare};
pub use error::ImageError;
pub use flip::{FlipMap, PIXELS_PER_DEGREE, flip};
#[cfg(feature = "pictures")]
pub use layers::{Channels, LINEAR_EXTENSIONS, Layer, has_layers, is_linear, layer_names, save_layers};
#[cfg(feature = "pictures")]
pub use load::{ends_early, has_high_range, load, load_with_alpha, size};
pub(crate) use reduced::reduce_colors;
pub use resize::{Resizer, resize};
#[cfg(feature = "pictures")]
pub use save::{KNOWN_EXTENSIONS, save};
#[cfg(feature = "pictures")]
pub use sky::{SkyImage, SkyPixels, load_sky};

/// Pixels per row, and rows, that a picture has at most.
pub const MAX_SIDE: u32 = 16_384;

/// Picture formats that are read.
pub const READ_FORMATS: &str = "PNG, JPEG, TGA, BMP, GIF, TIFF, WebP or PPM";

/// Picture formats of linear light without an upper end, which are read for skies.
pub const HIGH_RANGE_FORMATS: &str = "Radiance HDR or OpenEXR";

/// A picture of three sRGB bytes per pixel, rows from top to bottom.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbImage {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `3 * width * height` bytes: R, G, B of the top left pixel first.
    pub pixels: Vec<u8>,
}

/// A picture of linear RGB, rows from top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearImage {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `3 * width * height` channels: R, G, B of the top left pixel first.
    pub pixels: Vec<f32>,
}

impl RgbImage {
    /// A black picture.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, pixels: vec![0; byte_count(width, height)] }
    }

    /// The colour at column `x` of row `y`, or `None` outside the picture.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let first = byte_count(self.width, y) + 3 * x as usize;
        let bytes = self.pixels.get(first..first + 3)?;
        bytes.try_into().ok()
    }

    /// Refuses a picture whose buffer does not match its size.
    fn check(&self) -> Result<(), ImageError> {
        let expected = byte_count(self.width, self.height);
        if self.pixels.len() == expected {
            Ok(())
        } else {
            Err(ImageError::WrongBuffer {
                width: self.width,
                height: self.height,
                expected,
                actual: self.pixels.len(),
            })
        }
    }

    /// Refuses two pictures that cannot be compared pixel by pixel.
    fn check_against(&self, other: &Self) -> Result<(), ImageError> {
        self.check()?;
        other.check()?;
        let (a, b) = ((self.width, self.height), (other.width, other.height));
        if a == b { Ok(()) } else { Err(ImageError::SizesDiffer { a, b }) }
    }
}

impl LinearImage {
    /// Refuses a picture whose buffer does not match its size, and one of another size.
    pub(crate) fn check_against(&self, other: &Self) -> Result<(), ImageError> {
        let size = |picture: &Self| (picture.width, picture.height);
        for picture in [self, other] {
            let Self { width, height, ref pixels } = *picture;
            let (expected, actual) = (byte_count(width, height), pixels.len());
            if expected != actual {
                return Err(ImageError::WrongBuffer { width, height, expected, actual });
            }
        }
        let (a, b) = (size(self), size(other));
        if a == b { Ok(()) } else { Err(ImageError::SizesDiffer { a, b }) }
    }
}

/// Channels of all pixels of a picture.
fn byte_count(width: u32, height: u32) -> usize {
    (width as usize).saturating_mul(height as usize).saturating_mul(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_found_row_by_row_from_the_top() {
        let image = RgbImage { width: 2, height: 2, pixels: (0..12).collect() };
        assert_eq!(image.pixel(1, 0), Some([3, 4, 5]));
        assert_eq!(image.pixel(0, 1), Some([6, 7, 8]));
        assert_eq!(image.pixel(2, 0), None);
        assert_eq!(image.pixel(0, 2), None);
    }
}
