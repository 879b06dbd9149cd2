//! The stages of a tile, for benchmarks: rendering itself reads no clock.

use crate::intersect::RaySegment;

/// A stage of the work on a tile of 256 rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Closest hits, and the setup of the tile.
    Visible,
    /// Points, normals, materials and texels at the hits; once a tile.
    Surfaces,
    /// The shading equation without shadows: background and ambient term once a tile, then each light.
    Shading,
    /// Shadow rays; once for each light with shadows that contributes to a point of the tile.
    Shadows,
    /// Closest hits of reflected and transmitted rays; once a batch of them, only in scenes that bounce.
    Secondary,
    /// Means of the samples of pixels, and their sRGB bytes.
    Encoding,
}

impl Stage {
    /// All stages, in the order of a tile.
    pub const ALL: [Stage; 6] =
        [Stage::Visible, Stage::Surfaces, Stage::Shading, Stage::Shadows, Stage::Secondary, Stage::Encoding];
}

/// Receives stage changes and secondary rays. The implementation for `()` compiles to nothing.
pub trait Watch {
    /// Ends the previous stage and begins another one.
    fn enter(&mut self, stage: Stage);

    /// Receives the reflected and transmitted rays of a batch, before they are traced.
    fn secondary_rays(&mut self, _: impl Iterator<Item = RaySegment>) {}
}

impl Watch for () {
    #[inline(always)]
    fn enter(&mut self, _: Stage) {}
}
