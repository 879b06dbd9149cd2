//! Blinn-Phong materials as plain data.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Largest Blinn-Phong exponent.
pub const MAX_EXPONENT: f32 = 1e6;

/// A Blinn-Phong material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// c_d, linear RGB; a factor of the texel where there is a texture.
    pub diffuse: Vec3,
    /// c_s, linear RGB; zero means no specular term, and none is computed.
    pub specular: Vec3,
    /// p_r, the Blinn-Phong exponent, from 0 to [`MAX_EXPONENT`].
    pub exponent: f32,
    /// Diffuse texture, an index into [`crate::scene::Scene::textures`]. Valid only on geometry with texture coordinates.
    pub texture: Option<u32>,
    /// Cut-out texture, an index into [`crate::scene::Scene::textures`]: where its alpha is below one half, the surface is
    /// absent.
    pub cutout: Option<u32>,
    /// Emission, linear RGB, added on the front side of triangles and planes and on the outside of spheres; a factor of the
    /// texel where there is a texture. It illuminates no other surface.
    pub emission: Vec3,
    /// Emission texture, an index into [`crate::scene::Scene::textures`].
    pub emission_texture: Option<u32>,
    /// Whether c_d is shown as it is: without lights, shadows, the ambient term and highlights.
    pub unlit: bool,
    /// Whether vertex colours of the mesh, if it has any, are a factor of c_d.
    pub vertex_colors: bool,
}

impl Material {
    /// The material of a model or primitive without one.
    pub const NEUTRAL: Material = Material {
        diffuse: Vec3::splat(0.7),
        specular: Vec3::splat(0.2),
        exponent: 32.0,
        texture: None,
        cutout: None,
        emission: Vec3::ZERO,
        emission_texture: None,
        unlit: false,
        vertex_colors: false,
    };

    /// All textures of the material, as indices into [`crate::scene::Scene::textures`].
    pub fn textures(&self) -> impl Iterator<Item = u32> {
        [self.texture, self.cutout, self.emission_texture].into_iter().flatten()
    }

    /// Whether the emission is not zero.
    pub fn is_emissive(&self) -> bool {
        self.emission != Vec3::ZERO
    }

    /// Whether the specular colour is not zero.
    pub fn is_specular(&self) -> bool {
        self.specular != Vec3::ZERO
    }

    /// Whether (N.H)^p is computed by squaring, so that [`crate::scene::ExponentPrecision`] makes no difference: whole
    /// exponents up to 256, where squaring rounds less than a logarithm.
    pub fn has_squared_highlight(&self) -> bool {
        is_squared(self.exponent)
    }
}

/// Whether a power with this exponent is computed by squaring: see [`Material::has_squared_highlight`].
#[inline(always)]
pub(crate) fn is_squared(exponent: f32) -> bool {
    const MAX_SQUARED: u32 = 256;
    let whole = exponent as u32;
    whole as f32 == exponent && whole <= MAX_SQUARED
}
