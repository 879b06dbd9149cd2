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
    Repeated,
    /// The outermost texel.
    Clamped,
    /// The picture repeated, every second time reflected.
    Reflected,
}

impl Border {
    /// The texel at an index inside or outside of a picture with `size` texels.
    pub(super) fn index(self, index: f64, size: f64) -> f64 {
        match self {
            Border::Repeated => index.rem_euclid(size),
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

    /// The filtered values of a texture's texels. Texel (i, j), counted from the bottom left, has its centre at
    /// ((i + 1/2) / width, (j + 1/2) / height).
    fn look_up(
        &self,
        map: TextureMap,
        uv: DVec2,
        value: impl Fn(&Texture, u32, u32) -> DVec4,
    ) -> Option<DVec4> {
        let texture = self.textures.iter().find(|texture| texture.id() == map.texture)?;
        let (width, height) = (f64::from(texture.width()), f64::from(texture.height()));
        let border = match map.tiling.wrap {
            Wrap::Repeat => Border::Repeated,
            Wrap::Clamp => Border::Clamped,
            Wrap::Mirror => Border::Reflected,
        };
        let value_of =
            |i: f64, j: f64| value(texture, border.index(i, width) as u32, border.index(j, height) as u32);
        let uv = uv * map.tiling.scale.as_dvec2() + map.tiling.offset.as_dvec2();
        let (x, y) = (uv.x * width, uv.y * height);
        if self.view.quality.filter.unwrap_or(map.filter) == Filter::Nearest {
            return Some(value_of(x.floor(), y.floor()));
        }
        let (left, bottom) = ((x - 0.5).floor(), (y - 0.5).floor());
        let mut sum = DVec4::ZERO;
        for (i, j) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let (i, j) = (left + i, bottom + j);
            let weight = (1.0 - (x - 0.5 - i).abs()) * (1.0 - (y - 0.5 - j).abs());
            sum += value_of(i, j) * weight;
        }
        Some(sum)
    }
}

/// Linear RGB of the texel in column `i`, from the left, of row `j`, from the bottom.
pub(super) fn linear_texel(texture: &Texture, i: u32, j: u32) -> DVec3 {
    if texture.is_linear() {
        DVec3::from_array(texture.linear_texel(i, j).map(f64::from))
    } else {
        DVec3::from_array(texture.texel(i, j).map(srgb::decode))
    }
}
