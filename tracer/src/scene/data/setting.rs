//! The full description of how faithfully a picture is rendered.

use super::{Integrator, Quality, RenderScale};

/// Integrator, sample count, scale and quality knobs of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// How light is computed. As a limit it changes no integrator to another one, only settings of the path integrator.
    pub integrator: Integrator,
    /// Rays per pixel: with direct light a square number; any number of paths.
    pub samples: u32,
    /// Share of width and height that is rendered.
    pub scale: RenderScale,
    /// Quality knobs of the tracer.
    pub quality: Quality,
}
