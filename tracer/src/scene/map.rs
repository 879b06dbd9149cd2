//! How a texture is laid over texture coordinates and looked up.

use glam::{DVec2, Vec2};
use serde::{Deserialize, Serialize};

use crate::texture::TextureId;

/// Largest scale and offset of a texture, in magnitude: products with texture coordinates stay finite.
pub const MAX_TILING: f32 = 1e6;

/// A texture and how it is looked up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureMap {
    /// The picture.
    pub texture: TextureId,
    /// What lies between its texels.
    pub filter: Filter,
    /// Where it lies, and what is around it.
    pub tiling: Tiling,
}

impl TextureMap {
    /// A texture that repeats once a unit.
    pub fn new(texture: TextureId, filter: Filter) -> Self {
        Self { texture, filter, tiling: Tiling::default() }
    }
}

/// What lies between the centres of texels, at ((i + 0.5) / width, (j + 0.5) / height).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// The four texels around, weighted by nearness, in linear light.
    Bilinear,
}

/// What lies outside of [0, 1] in both directions of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wrap {
    /// The picture again.
    Repeat,
    /// The nearest texel of its border.
    Clamp,
    /// The picture reflected, and then again.
    Mirror,
}

impl Wrap {
    /// The words of scene files.
    pub const WORDS: [(&str, Self); 3] =
        [("repeat", Self::Repeat), ("clamp", Self::Clamp), ("mirror", Self::Mirror)];
}

/// Where a picture lies: it is looked up at uv * `scale` + `offset`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tiling {
    /// What is around the picture.
    pub wrap: Wrap,
    /// Repeats a unit of u and of v.
    pub scale: Vec2,
    /// Added after scaling, in repeats.
    pub offset: Vec2,
}

impl Default for Tiling {
    /// One repeat a unit.
    fn default() -> Self {
        Self { wrap: Wrap::Repeat, scale: Vec2::ONE, offset: Vec2::ZERO }
    }
}

impl Tiling {
    /// Whether texture coordinates that differ by whole numbers may see different texels. Else whole numbers may be taken off
    /// them: see [`crate::texture::without_repeats`].
    pub fn tells_repeats_apart(&self) -> bool {
        self.wrap != Wrap::Repeat || self.scale != self.scale.round()
    }

    /// Whether its numbers are finite and within [`MAX_TILING`].
    pub(crate) fn is_usable(&self) -> bool {
        [self.scale, self.offset]
            .into_iter()
            .all(|numbers| numbers.abs().cmple(Vec2::splat(MAX_TILING)).all())
    }

    /// Where texture coordinates lie in the picture: both from 0 to 1. In `f64`, for what is decided exactly.
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
    fn outside_of_the_picture_is_what_the_word_says() {
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
    fn only_whole_repeats_may_be_taken_off() {
        let with = |wrap, x: f32| Tiling { wrap, scale: Vec2::new(x, 1.0), offset: Vec2::splat(0.3) };
        assert!(!with(Wrap::Repeat, 3.0).tells_repeats_apart());
        assert!(!with(Wrap::Repeat, -2.0).tells_repeats_apart());
        assert!(with(Wrap::Repeat, 1.5).tells_repeats_apart());
        assert!(
            with(Wrap::Clamp, 1.0).tells_repeats_apart() && with(Wrap::Mirror, 1.0).tells_repeats_apart()
        );
    }
}
