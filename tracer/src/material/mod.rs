//! Materials as plain data.

mod direct;

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Largest Blinn-Phong exponent.
pub const MAX_EXPONENT: f32 = 1e6;

/// A material: Blinn-Phong with mirrors and glass, or metallic-roughness.
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
    /// texel where there is a texture. Only paths find it as a light of other surfaces.
    pub emission: Vec3,
    /// Emission texture, an index into [`crate::scene::Scene::textures`].
    pub emission_texture: Option<u32>,
    /// Whether c_d is shown as it is: without lights, shadows, the ambient term and highlights.
    pub unlit: bool,
    /// Whether vertex colours of the mesh, if it has any, are a factor of c_d.
    pub vertex_colors: bool,
    /// A pattern of two colours: a factor of c_d, which loaders make white, in place of its texture.
    pub checker: Option<Checker>,
    /// Texture that tilts shading normals. Valid only on geometry with texture coordinates.
    pub normal_map: Option<NormalMap>,
    /// c_r: share of light that is reflected as by a mirror, linear RGB from 0 to 1.
    pub reflect: Vec3,
    /// c_t: share of light that is transmitted, linear RGB from 0 to 1.
    pub transmit: Vec3,
    /// Index of refraction of the inside, above zero.
    pub ior: f32,
    /// Whether it is a sheet without an inside: rays are transmitted straight, and not absorbed.
    pub thin: bool,
    /// Whether c_r and c_t are weighted by the Fresnel shares of reflection and transmission.
    pub fresnel: bool,
    /// Share of light that is left after one world unit of way inside, linear RGB in (0, 1].
    pub absorption: Vec3,
    /// Whether it casts shadows: without, it lets all light through to what is behind.
    pub casts_shadow: bool,
    /// The metallic-roughness model in place of Blinn-Phong: c_d is then the base colour, and c_s, p_r, c_r and c_t are those by which the
    /// direct integrator shows the material: see [`Material::shown_directly`].
    pub metallic_roughness: Option<MetallicRoughness>,
}

/// The metallic-roughness model of glTF 2.0. The base colour and the index of refraction are those of the [`Material`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MetallicRoughness {
    /// Share of metal, from 0 to 1.
    pub metallic: f32,
    /// Perceptual roughness, from 0 to 1: the square root of the GGX width alpha.
    pub roughness: f32,
    /// Share of the light that is not reflected and is transmitted, not scattered, from 0 to 1.
    pub transmission: f32,
    /// Factor of the reflectance of what is not metal, from 0 to 1.
    pub specular_factor: f32,
    /// Texture whose green is a factor of the roughness and whose blue is one of the share of metal, each its byte / 255, an index into
    /// [`crate::scene::Scene::textures`]. Valid only on geometry with texture coordinates. Only the path integrator shows it.
    pub texture: Option<u32>,
}

/// A pattern of cubes or squares in two colours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checker {
    /// Linear RGB of the even and the odd cells.
    pub colors: [Vec3; 2],
    /// Side of a cell: in world units, or in repeats of texture coordinates.
    pub size: f32,
    /// Space in which the cells are laid out.
    pub space: CheckerSpace,
}

/// The space in which a [`Checker`] is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CheckerSpace {
    /// The object's own coordinates, so that the pattern moves with it: those of a model's file, in its units; else world units along
    /// the world's axes, from the centre of a sphere or a disk, the point of a plane or the first corner of a triangle.
    Object,
    /// World units along the axes of the world: objects move through the pattern.
    World,
    /// Texture coordinates.
    Uv,
}

impl CheckerSpace {
    /// Each value with its word.
    pub const WORDS: [(&'static str, Self); 3] =
        [("object", Self::Object), ("world", Self::World), ("uv", Self::Uv)];
}

/// A texture of normals in tangent space (x along u, y along v, z outwards), each channel 2 c - 1 of its bytes' share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NormalMap {
    /// Index into [`crate::scene::Scene::textures`].
    pub texture: u32,
    /// Factor of x and y.
    pub strength: f32,
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
        checker: None,
        normal_map: None,
        reflect: Vec3::ZERO,
        transmit: Vec3::ZERO,
        ior: 1.5,
        thin: false,
        fresnel: false,
        absorption: Vec3::ONE,
        casts_shadow: true,
        metallic_roughness: None,
    };

    /// All textures of the material, as indices into [`crate::scene::Scene::textures`].
    pub fn textures(&self) -> impl Iterator<Item = u32> {
        let normals = self.normal_map.map(|map| map.texture);
        let rough = self.metallic_roughness.and_then(|model| model.texture);
        [self.texture, self.cutout, self.emission_texture, normals, rough].into_iter().flatten()
    }

    /// Whether a texture has its roughness and its share of metal.
    pub fn has_rough_texture(&self) -> bool {
        self.metallic_roughness.is_some_and(|model| model.texture.is_some())
    }

    /// Whether it needs texture coordinates: it has a texture, or a checker pattern that is laid in them.
    pub fn needs_uvs(&self) -> bool {
        let in_uvs = |checker: Checker| checker.space == CheckerSpace::Uv;
        self.checker.is_some_and(in_uvs) || self.textures().next().is_some()
    }

    /// Whether it reflects or transmits light.
    pub fn bounces(&self) -> bool {
        self.reflect != Vec3::ZERO || self.transmit != Vec3::ZERO
    }

    /// Whether it transmits light.
    pub fn is_transparent(&self) -> bool {
        self.transmit != Vec3::ZERO
    }

    /// Whether light is absorbed inside of it.
    pub fn absorbs(&self) -> bool {
        self.is_transparent() && !self.thin && self.absorption != Vec3::ONE
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
