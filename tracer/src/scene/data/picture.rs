//! What becomes of linear light: pixel formats, exposure and tone curves.

use serde::{Deserialize, Serialize};

/// Format of the pixels of rendered rows: bytes per pixel, and their range. All numbers are little endian.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum PixelFormat {
    /// Red, green and blue, one byte each, sRGB: 0 is black, 255 the largest value.
    #[default]
    Rgb8,
    /// Linear red, green and blue, an `f32` each, neither exposed nor mapped by a tone curve.
    Linear,
    /// Exact sums of the samples of a pixel, which later passes add to: see [`crate::PixelSums`]. Only the path integrator has
    /// them.
    Sums,
}

impl PixelFormat {
    /// Bytes of a pixel.
    pub const fn bytes_per_pixel(self) -> usize {
        match self {
            Self::Rgb8 => 3,
            Self::Linear => 12,
            Self::Sums => 24,
        }
    }

    /// Largest value of a channel.
    pub const fn max_value(self) -> f32 {
        match self {
            Self::Rgb8 => 255.0,
            Self::Linear | Self::Sums => f32::MAX,
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

/// How linear light becomes the colours of a display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToneMapping {
    /// Exposure in stops: light is multiplied by 2 to this power.
    pub exposure: f32,
    /// The curve.
    pub curve: ToneCurve,
}

/// Curves from linear light to the colours of a display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToneCurve {
    /// The transfer function of sRGB; all above 1 is white.
    #[default]
    Srgb,
    /// AgX, in the approximation by a polynomial of sixth degree.
    Agx,
    /// ACES filmic, in Narkowicz' approximation.
    Aces,
    /// The neutral tone mapper of Khronos.
    Neutral,
}

impl ToneCurve {
    /// Each value with its word.
    pub const WORDS: [(&'static str, Self); 4] =
        [("srgb", Self::Srgb), ("agx", Self::Agx), ("aces", Self::Aces), ("neutral", Self::Neutral)];
}
