//! Lookup of textures: filter, wrap, scale and offset.

use glam::{DVec2, Vec2};
use serde::{Deserialize, Serialize};

use super::TextureId;

/// Largest scale and offset of a texture, in magnitude: products with texture coordinates stay finite.
pub const MAX_TILING: f32 = 1e6;

/// A texture with its lookup.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureMap {
    /// Hash of the texture.
    pub texture: TextureId,
    /// Interpolation between texels.
    pub filter: Filter,
    /// Placement in texture space.
    pub tiling: Tiling,
}

impl TextureMap {
    /// A texture with one repeat per unit.
    pub fn new(texture: TextureId, filter: Filter) -> Self {
        Self { texture, filter, tiling: Tiling::default() }
    }
}

/// Interpolation between the centres of texels, which are at ((i + 0.5) / width, (j + 0.5) / height).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// The four texels around, weighted by nearness, in linear light.
    Bilinear,
    /// Bilinear in the two levels of a pyramid of ever smaller pictures whose texels are next in size to a pixel, weighted by
    /// nearness (Williams, "Pyramidal Parametrics", 1983). Alpha cut-outs are filtered as by `Bilinear`.
    Trilinear,
}

impl Filter {
    /// Each value with its word.
    pub const WORDS: [(&'static str, Self); 3] =
        [("nearest", Self::Nearest), ("bilinear", Self::Bilinear), ("trilinear", Self::Trilinear)];
}

/// Texels outside of [0, 1], in both directions of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wrap {
    /// The picture repeated.
    Repeat,
    /// The nearest texel of the border.
    Clamp,
    /// The picture repeated, every second time reflected.
    Mirror,
}

impl Wrap {
    /// Each value with its word in scene files.
    pub const WORDS: [(&str, Self); 3] =
        [("repeat", Self::Repeat), ("clamp", Self::Clamp), ("mirror", Self::Mirror)];
}

/// Placement of a picture in texture space: it is looked up at uv * `scale` + `offset`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tiling {
    /// Texels outside of the picture.
    pub wrap: Wrap,
    /// Repeats per unit of u and of v.
    pub scale: Vec2,
    /// Added after scaling, in repeats.
    pub offset: Vec2,
}

impl Default for Tiling {
    /// One repeat per unit.
    fn default() -> Self {
        Self { wrap: Wrap::Repeat, scale: Vec2::ONE, offset: Vec2::ZERO }
    }
}

impl Tiling {
    /// Whether texture coordinates that differ by whole numbers may see different texels. Otherwise whole
    /// numbers may be removed from them: see [`super::without_repeats`].
    pub fn distinguishes_repeats(&self) -> bool {
        self.wrap != Wrap::Repeat || self.scale != self.scale.round()
    }

    /// Whether its numbers are finite and within [`MAX_TILING`].
    pub(crate) fn is_usable(&self) -> bool {
        [self.scale, self.offset]
            .into_iter()
            .all(|numbers| numbers.abs().cmple(Vec2::splat(MAX_TILING)).all())
    }

    /// Position in the picture, both coordinates from 0 to 1. In `f64`, for exact decisions.
    pub(crate) fn place(&self, uv: DVec2) -> DVec2 {
        let at = uv * self.scale.as_dvec2() + self.offset.as_dvec2();
        match self.wrap {
            Wrap::Repeat => at - at.floor(),
            Wrap::Clamp => at.clamp(DVec2::ZERO, DVec2::ONE),
            Wrap::Mirror => {
                let pair = at - (at * 0.5).floor() * 2.0;
                pair.min(DVec2::splat(2.0) - pair)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps_repeat_clamp_and_mirror() {
        let place = |wrap, x: f64| Tiling { wrap, ..Tiling::default() }.place(DVec2::new(x, 0.5)).x;
        for (x, repeat, clamp, mirror) in [
            (0.25, 0.25, 0.25, 0.25),
            (1.25, 0.25, 1.0, 0.75),
            (2.25, 0.25, 1.0, 0.25),
            (-0.25, 0.75, 0.0, 0.25),
            (-1.25, 0.75, 0.0, 0.75),
        ] {
            let found = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror].map(|wrap| place(wrap, x));
            assert_eq!(found, [repeat, clamp, mirror], "{x}");
        }
        let moved = Tiling { scale: Vec2::new(3.0, -1.0), offset: Vec2::new(0.5, 0.25), ..Tiling::default() };
        assert_eq!(moved.place(DVec2::new(0.25, 0.5)), DVec2::new(0.25, 0.75));
    }

    #[test]
    fn only_whole_repeats_may_be_removed() {
        let with = |wrap, x: f32| Tiling { wrap, scale: Vec2::new(x, 1.0), offset: Vec2::splat(0.3) };
        assert!(!with(Wrap::Repeat, 3.0).distinguishes_repeats());
        assert!(!with(Wrap::Repeat, -2.0).distinguishes_repeats());
        assert!(with(Wrap::Repeat, 1.5).distinguishes_repeats());
        assert!(
            with(Wrap::Clamp, 1.0).distinguishes_repeats() && with(Wrap::Mirror, 1.0).distinguishes_repeats()
        );
    }
}
