//! What a tile of rays goes through, told to whoever measures: rendering itself reads no clock.

/// A part of the work on a tile of 256 rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// What each ray sees first; the tile's own set-up as well.
    Visible,
    /// Points, normals, materials and texels at the hits; once a tile.
    Surfaces,
    /// The shading equation but for its shadows: background and ambient term once a tile, then each light.
    Shading,
    /// Which points a light does not reach; once for each light with shadows that adds to a point of the tile.
    Shadows,
    /// The mean of a pixel's samples, and its sRGB bytes.
    Encoding,
}

impl Stage {
    /// All of them, in the order in which a tile first comes to them.
    pub const ALL: [Stage; 5] =
        [Stage::Visible, Stage::Surfaces, Stage::Shading, Stage::Shadows, Stage::Encoding];
}

/// Is told when a tile comes to a stage. `()` does not listen, and then nothing is left of the telling.
pub trait Watch {
    /// What was done until now is over, and this begins.
    fn enter(&mut self, stage: Stage);
}

impl Watch for () {
    #[inline(always)]
    fn enter(&mut self, _: Stage) {}
}
