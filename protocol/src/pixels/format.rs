//! The layout of a decoded pixel.

use std::ops::RangeInclusive;

use crate::limits::MAX_PIXELS_BYTES;

/// Layout of a decoded pixel: its bytes, and the values that they hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PixelFormat {
    /// Red, green and blue of one byte each, encoded as sRGB.
    #[default]
    Rgb8,
}

impl PixelFormat {
    /// Format of the pixels of every segment in this version of the protocol. No message names it.
    pub const SEGMENT: Self = Self::Rgb8;

    /// Number of bytes of one pixel.
    pub const fn bytes_per_pixel(self) -> usize {
        match self {
            Self::Rgb8 => 3,
        }
    }

    /// Smallest and largest value of a channel.
    pub const fn channel_range(self) -> RangeInclusive<f32> {
        match self {
            Self::Rgb8 => 0.0..=255.0,
        }
    }

    /// Number of bytes of a row of `width` pixels.
    pub const fn row_bytes(self, width: u32) -> usize {
        (width as usize).saturating_mul(self.bytes_per_pixel())
    }

    /// Number of bytes of `row_count` rows of `width` pixels, or `None` where one envelope cannot carry them.
    pub fn segment_bytes(self, width: u32, row_count: u32) -> Option<usize> {
        let bytes = self.row_bytes(width).checked_mul(row_count as usize)?;
        (bytes <= MAX_PIXELS_BYTES).then_some(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rgb8_has_three_bytes_from_0_to_255() {
        let format = PixelFormat::SEGMENT;
        assert_eq!((format.bytes_per_pixel(), format.row_bytes(5)), (3, 15));
        assert_eq!(format.channel_range(), f32::from(u8::MIN)..=f32::from(u8::MAX));
    }

    #[test]
    fn a_segment_fits_into_one_envelope() {
        let format = PixelFormat::Rgb8;
        assert_eq!(format.segment_bytes(3840, 2160), Some(3840 * 2160 * 3));
        assert_eq!(format.segment_bytes(0, 9), Some(0));
        let rows = (MAX_PIXELS_BYTES / format.row_bytes(640)) as u32;
        assert_eq!(format.segment_bytes(640, rows), Some(rows as usize * 1920));
        assert_eq!(format.segment_bytes(640, rows + 1), None);
        assert_eq!(format.segment_bytes(u32::MAX, u32::MAX), None);
    }
}
