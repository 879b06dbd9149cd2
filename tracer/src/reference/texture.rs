//! Texture lookups of the oracle.

use glam::{DVec2, DVec3, DVec4};

use super::Oracle;
use crate::scene::{Filter, TextureMap, Wrap};
use crate::srgb;
use crate::texture::Texture;

/// Texels outside of a picture, along one of its sides.
#[derive(Clone, Copy)]
pub(super) enum Border {
    /// The picture repeated.
    Cyclic,
    /// The outermost texel.
    Clamped,
    /// The picture repeated, every second time reflected.
    Reflected,
}

impl Border {
    /// The texel at an index inside or outside of a picture with `size` texels.
    pub(super) fn index(self, index: f64, size: f64) -> f64 {
        match self {
            Border::Cyclic => index.rem_euclid(size),
            Border::Clamped => index.clamp(0.0, size - 1.0),
            Border::Reflected => {
                let pair = index.rem_euclid(2.0 * size);
                pair.min(2.0 * size - 1.0 - pair)
            }
        }
    }
}

impl Oracle {
    /// Linear RGB and alpha of a texture at texture coordinates.
    pub(super) fn texel(&self, map: TextureMap, uv: DVec2) -> DVec4 {
        self.look_up(map, uv, |texture, i, j| {
            linear_texel(texture, i, j).extend(f64::from(texture.alpha(i, j)) / 255.0)
        })
        .unwrap_or(DVec4::ONE)
    }

    /// The bytes of a texture at texture coordinates, as shares of 255; `None` if the texture is missing.
    pub(super) fn shares(&self, map: TextureMap, uv: DVec2) -> Option<DVec3> {
        let shares = |texture: &Texture, i, j| {
            DVec3::from_array(texture.texel(i, j).map(|byte| f64::from(byte) / 255.0)).extend(1.0)
        };
        self.look_up(map, uv, shares).map(DVec4::truncate)
    }

    /// The filtered values of a texture's texels. The trilinear filter is the bilinear one.
    fn look_up(
        &self,
        map: TextureMap,
        uv: DVec2,
        value: impl Fn(&Texture, u32, u32) -> DVec4,
    ) -> Option<DVec4> {
        let texture = self.textures.iter().find(|texture| texture.id() == map.texture)?;
        let size = [texture.width(), texture.height()];
        let value = |i, j| value(texture, i, j);
        Some(match self.view.quality.filter.unwrap_or(map.filter) {
            Filter::Nearest => nearest(&map, size, uv, value),
            Filter::Bilinear | Filter::Trilinear => bilinear(&map, size, uv, value),
        })
    }
}

impl Border {
    fn of(map: &TextureMap) -> Self {
        match map.tiling.wrap {
            Wrap::Repeat => Border::Cyclic,
            Wrap::Clamp => Border::Clamped,
            Wrap::Mirror => Border::Reflected,
        }
    }
}

/// The place of texture coordinates in a picture, in texels from its bottom left corner.
fn place(map: &TextureMap, [width, height]: [u32; 2], uv: DVec2) -> DVec2 {
    let uv = uv * map.tiling.scale.as_dvec2() + map.tiling.offset.as_dvec2();
    uv * DVec2::new(f64::from(width), f64::from(height))
}

/// The value of the texel that contains a place.
fn nearest(map: &TextureMap, size: [u32; 2], uv: DVec2, value: impl Fn(u32, u32) -> DVec4) -> DVec4 {
    let (at, border, [width, height]) = (place(map, size, uv).floor(), Border::of(map), size.map(f64::from));
    value(border.index(at.x, width) as u32, border.index(at.y, height) as u32)
}

/// The mean of the four texels around a place. Texel (i, j), counted from the bottom left, has its centre at
/// ((i + 1/2) / width, (j + 1/2) / height).
pub(super) fn bilinear(
    map: &TextureMap,
    size: [u32; 2],
    uv: DVec2,
    value: impl Fn(u32, u32) -> DVec4,
) -> DVec4 {
    let (border, [width, height]) = (Border::of(map), size.map(f64::from));
    let from_centers = place(map, size, uv) - 0.5;
    let first = from_centers.floor();
    let mut sum = DVec4::ZERO;
    for (i, j) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let (i, j) = (first.x + i, first.y + j);
        let weight = (1.0 - (from_centers.x - i).abs()) * (1.0 - (from_centers.y - j).abs());
        sum += value(border.index(i, width) as u32, border.index(j, height) as u32) * weight;
    }
    sum
}

/// Linear RGB of the texel in column `i`, from the left, of row `j`, from the bottom.
pub(super) fn linear_texel(texture: &Texture, i: u32, j: u32) -> DVec3 {
    if texture.is_linear() {
        return DVec3::from_array(texture.linear_texel(i, j).map(f64::from));
    }
    DVec3::from_array(texture.texel(i, j).map(srgb::decode))
}
