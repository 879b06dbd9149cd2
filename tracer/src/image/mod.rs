//! Finished pictures: held as sRGB bytes, written to and read from files, compared.

mod compare;
mod flip;
mod load;
mod reduced;
mod resize;
mod save;
mod ssim;

use std::path::PathBuf;

pub use compare::{Difference, compare};
pub use flip::{FlipMap, PIXELS_PER_DEGREE, flip};
pub(crate) use load::ends_early;
pub use load::{load, load_with_alpha, size};
pub(crate) use reduced::reduce_colors;
pub use resize::{Resizer, resize};
pub use save::{KNOWN_EXTENSIONS, save};

/// Pixels per row, and rows, that a picture has at most.
pub const MAX_SIDE: u32 = 16_384;

/// Formats of pictures that are read.
pub const READ_FORMATS: &str = "PNG, JPEG, TGA, BMP, GIF, TIFF, WebP or PPM";

/// A picture as it is shown: three sRGB bytes a pixel, rows from top to bottom.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbImage {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `3 * width * height` bytes: R, G, B of the top left pixel first.
    pub pixels: Vec<u8>,
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

    /// Refuses a picture whose buffer does not fit its size.
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

fn byte_count(width: u32, height: u32) -> usize {
    (width as usize).saturating_mul(height as usize).saturating_mul(3)
}

/// What can go wrong with a picture.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file name does not say which format to write.
    #[error("cannot write {}: its extension is none of {KNOWN_EXTENSIONS}; end the file name in one of them", path.display())]
    UnknownExtension {
        /// The file asked for.
        path: PathBuf,
    },
    /// A picture whose buffer does not fit its size.
    #[error("a picture of {width} x {height} pixels needs {expected} bytes, but has {actual}")]
    WrongBuffer {
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes that the size asks for.
        expected: usize,
        /// Bytes that are there.
        actual: usize,
    },
    /// Two pictures that cannot be compared.
    #[error("pictures of different sizes cannot be compared: {} x {} and {} x {}", a.0, a.1, b.0, b.1)]
    SizesDiffer {
        /// Width and height of the first.
        a: (u32, u32),
        /// Width and height of the second.
        b: (u32, u32),
    },
    /// A distance from the monitor that nobody has.
    #[error("pictures are compared as seen at 1 to 1000 pixels per degree, not {given}")]
    PixelsPerDegree {
        /// What was asked for.
        given: f64,
    },
    /// The file cannot be written; nothing is left behind.
    #[error("cannot write {}: {source}; check that its folder exists and may be written to", path.display())]
    Write {
        /// The file asked for.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file asked for.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is no picture, a broken one, or one beyond the limits.
    #[error("cannot decode {} as {READ_FORMATS} of at most {MAX_SIDE} x {MAX_SIDE} pixels: {source}", path.display())]
    Decode {
        /// The file asked for.
        path: PathBuf,
        /// What the decoder says.
        source: ::image::ImageError,
    },
    /// The encoder refuses the picture; nothing is left behind.
    #[error("cannot encode {}: {source}", path.display())]
    Encode {
        /// The file asked for.
        path: PathBuf,
        /// What the encoder says.
        source: ::image::ImageError,
    },
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
