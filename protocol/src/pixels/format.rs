//! The layout of a decoded pixel.

use super::Encoding;
use crate::limits::MAX_PIXELS_BYTES;

/// Layout of a decoded pixel. The announcement of a frame names it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PixelFormat {
    /// Red, green and blue of one byte each, encoded for a display.
    #[default]
    Rgb8,
    /// Red, green and blue of linear light, an `f32` each, little endian.
    Linear,
    /// Exact sums of samples: red, green, blue, and all channels of every second sample; 48 bits each, little endian.
    Sums,
}

impl PixelFormat {
    /// All formats.
    pub const ALL: [Self; 3] = [Self::Rgb8, Self::Linear, Self::Sums];

    /// Number of bytes of one pixel.
    pub const fn bytes_per_pixel(self) -> usize {
        match self {
            Self::Rgb8 => 3,
            Self::Linear => 12,
            Self::Sums => 24,
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

    /// Encoding in blocks of LZ4. Bytes of numbers are sorted by their place in the pixel first: upper bytes repeat, lower ones
    /// are noise.
    pub const fn blocks(self) -> Encoding {
        match self {
            Self::Rgb8 => Encoding::Lz4,
            Self::Linear | Self::Sums => Encoding::PlanesLz4,
        }
    }

    /// Whether pixels of this format may be sent in an encoding.
    pub const fn allows(self, encoding: Encoding) -> bool {
        match encoding {
            Encoding::Raw => true,
            Encoding::Lz4 | Encoding::Rgb565 | Encoding::Rgb565Lz4 => matches!(self, Self::Rgb8),
            Encoding::PlanesLz4 => !matches!(self, Self::Rgb8),
        }
    }

    /// Number of the format on the wire.
    pub(crate) const fn code(self) -> u32 {
        match self {
            Self::Rgb8 => 0,
            Self::Linear => 1,
            Self::Sums => 2,
        }
    }

    pub(crate) fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.code() == code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_format_has_its_bytes_and_its_code() {
        let bytes = PixelFormat::ALL.map(|format| (format.bytes_per_pixel(), format.row_bytes(5)));
        assert_eq!(bytes, [(3, 15), (12, 60), (24, 120)]);
        assert_eq!([0, 1, 2].map(PixelFormat::from_code), PixelFormat::ALL.map(Some));
        assert_eq!(PixelFormat::from_code(3), None);
    }

    #[test]
    fn a_segment_fits_into_one_envelope() {
        assert_eq!(PixelFormat::Rgb8.segment_bytes(3840, 2160), Some(3840 * 2160 * 3));
        assert_eq!(PixelFormat::Sums.segment_bytes(3840, 2160), None);
        for format in PixelFormat::ALL {
            assert_eq!(format.segment_bytes(0, 9), Some(0));
            let rows = (MAX_PIXELS_BYTES / format.row_bytes(640)) as u32;
            assert_eq!(format.segment_bytes(640, rows), Some(rows as usize * format.row_bytes(640)));
            assert_eq!(format.segment_bytes(640, rows + 1), None);
            assert_eq!(format.segment_bytes(u32::MAX, u32::MAX), None);
        }
    }

    #[test]
    fn blocks_are_an_encoding_that_the_format_allows() {
        for format in PixelFormat::ALL {
            assert!(format.allows(Encoding::Raw) && format.allows(format.blocks()));
            assert_eq!(format.allows(Encoding::Rgb565Lz4), format == PixelFormat::Rgb8);
        }
    }
}
