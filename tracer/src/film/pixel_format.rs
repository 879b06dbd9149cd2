//! The format of a frame's pixels.

use crate::frame::PreparedFrame;

/// Format of the pixels of rendered rows: bytes per pixel, and their range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PixelFormat {
    /// Red, green and blue, one byte each, sRGB: 0 is black, 255 the largest value.
    Rgb8,
}

impl PixelFormat {
    /// Bytes of a pixel.
    pub const fn bytes_per_pixel(self) -> usize {
        match self {
            Self::Rgb8 => 3,
        }
    }

    /// Largest value of a channel.
    pub const fn max_value(self) -> f32 {
        match self {
            Self::Rgb8 => 255.0,
        }
    }

    /// Bytes of a row of pixels.
    pub const fn row_bytes(self, width: u32) -> usize {
        width as usize * self.bytes_per_pixel()
    }

    /// Bytes of a number of rows of pixels.
    pub const fn bytes_of(self, width: u32, rows: u32) -> usize {
        self.row_bytes(width) * rows as usize
    }
}

impl PreparedFrame {
    /// Format of the pixels that rendering writes.
    pub fn pixel_format(&self) -> PixelFormat {
        PixelFormat::Rgb8
    }

    /// Bytes of a row of the frame.
    pub fn row_bytes(&self) -> usize {
        self.pixel_format().row_bytes(self.width())
    }
}
