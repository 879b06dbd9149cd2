//! The full description of how faithfully a picture is rendered.

use super::{Quality, RenderScale};

/// Sample count, scale and quality knobs of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Rays per pixel, a square number.
    pub samples: u32,
    /// Share of width and height that is rendered.
    pub scale: RenderScale,
    /// Quality knobs of the tracer.
    pub quality: Quality,
}
