//! Texture lookups of the oracle.

use glam::{DVec2, DVec4};

use super::Oracle;
use crate::scene::{Filter, TextureMap, Wrap};
use crate::srgb;

impl Oracle {
    /// Linear RGB and alpha of a texture at texture coordinates. Texel (i, j), counted from the bottom left, has its centre at
    /// ((i + 1/2) / width, (j + 1/2) / height).
    pub(super) fn texel(&self, map: TextureMap, uv: DVec2) -> DVec4 {
        let Some(texture) = self.textures.iter().find(|texture| texture.id() == map.texture) else {
            return DVec4::ONE;
        };
        let (width, height) = (f64::from(texture.width()), f64::from(texture.height()));
        let color_of = |i: f64, j: f64| {
            let (i, j) = (wrapped(i, width, map.tiling.wrap), wrapped(j, height, map.tiling.wrap));
            let [r, g, b] = texture.texel(i, j).map(srgb::decode);
            DVec4::new(r, g, b, f64::from(texture.alpha(i, j)) / 255.0)
        };
        let uv = uv * map.tiling.scale.as_dvec2() + map.tiling.offset.as_dvec2();
        let (x, y) = (uv.x * width, uv.y * height);
        match self.view.quality.filter.unwrap_or(map.filter) {
            Filter::Nearest => color_of(x.floor(), y.floor()),
            Filter::Bilinear | Filter::Trilinear => {
                let (left, bottom) = ((x - 0.5).floor(), (y - 0.5).floor());
                let mut sum = DVec4::ZERO;
                for (i, j) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                    let (i, j) = (left + i, bottom + j);
                    let weight = (1.0 - (x - 0.5 - i).abs()) * (1.0 - (y - 0.5 - j).abs());
                    sum += color_of(i, j) * weight;
                }
                sum
            }
        }
    }
}

/// The texel at an index inside or outside of a texture.
fn wrapped(index: f64, size: f64, wrap: Wrap) -> u32 {
    let inside = match wrap {
        Wrap::Repeat => index.rem_euclid(size),
        Wrap::Clamp => index.clamp(0.0, size - 1.0),
        Wrap::Mirror => {
            let pair = index.rem_euclid(2.0 * size);
            pair.min(2.0 * size - 1.0 - pair)
        }
    };
    inside as u32
}
