//! What to draw, as plain data: no file handles, no acceleration structures, nothing derived.
//!
//! A [`Scene`] names its meshes by hash ([`MeshId`]) and its materials by index, so it serialises to a few
//! kilobytes whatever it shows. Positions and transforms are `f64`: a scene may stand 10^7 extents from the origin,
//! and digits are dropped only after the camera's position has been subtracted. Colours are linear RGB.

mod error;
mod file;
mod foreign;
mod framing;
mod load;
mod lookup;
mod map;
mod moved;
mod obj;
mod options;
mod printed;
pub mod quality;
mod read;
pub mod rotation;
mod text;
mod textures;
mod validate;
mod warnings;

use glam::{DVec3, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::mesh::MeshId;

pub use error::SceneError;
pub use load::{LoadedScene, compile_model, compile_model_with, load, load_with};
pub use map::{Filter, MAX_TILING, TextureMap, Tiling, Wrap};
pub use options::{DEFAULT_CREASE_ANGLE, LoadOptions, Up};
pub use quality::{ColorDepth, ExponentPrecision, Quality, RenderScale, Shading};
pub use validate::{
    MAX_COORDINATE, MAX_DEPTH, MAX_EXPONENT, MAX_LIGHT, MAX_LIGHTS, MAX_MATERIALS, MAX_MODELS, MAX_PLANES,
    MAX_SAMPLES, MAX_SLOTS, MAX_SPHERES, MAX_TEXTURES, MAX_TRIANGLES, ValidateError,
};

/// A whole scene: what the scene file says, resolved and validated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// I_a, added once per hit, times the diffuse colour.
    pub ambient: Vec3,
    /// Picture size and sampling that the scene asks for; the command line may override them.
    pub render: RenderSettings,
    /// The camera the scene starts with.
    pub camera: Camera,
    /// What a ray that hits nothing sees.
    pub background: Background,
    /// Lights; never empty after loading (a scene without one gets the default light).
    pub lights: Vec<Light>,
    /// Materials; every index in the scene points in here.
    pub materials: Vec<Material>,
    /// Textures of materials; every index of a material points in here.
    pub textures: Vec<TextureMap>,
    /// Instances of compiled meshes.
    pub models: Vec<Model>,
    /// Analytic spheres.
    pub spheres: Vec<Sphere>,
    /// Infinite planes.
    pub planes: Vec<Plane>,
    /// Single triangles of the scene file.
    pub triangles: Vec<Triangle>,
}

/// Picture size and sampling.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderSettings {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Rays per pixel: a square number, n * n on a regular grid.
    pub samples: u32,
    /// Bounces of reflection and transmission. No material bounces yet, so no picture depends on it yet.
    pub max_depth: u32,
    /// A bounce that can add less than this is not traced.
    pub min_contribution: f32,
    /// What may be left out or done more roughly.
    pub quality: Quality,
    /// The part of width and height that is rendered.
    pub scale: RenderScale,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: 1024,
            height: 768,
            samples: 1,
            max_depth: 5,
            min_contribution: 0.004,
            quality: Quality::default(),
            scale: RenderScale::Full,
        }
    }
}

/// A pinhole camera. `look_at` differs from `position`, and `up` is not parallel to the view direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// World position.
    pub position: DVec3,
    /// The point in the middle of the picture; orbits go round it.
    pub look_at: DVec3,
    /// Upwards in the picture; any length, not necessarily perpendicular to the view direction.
    pub up: DVec3,
    /// Vertical field of view in degrees, inside (0, 180).
    pub fov: f64,
    /// Divides the view plane's size.
    pub zoom: f64,
}

/// What a ray that hits nothing sees, linear RGB.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Background {
    /// One colour.
    Color(Vec3),
    /// From `bottom` (a ray straight down, -Y) to `top` (straight up), linear in (d.y + 1) / 2 of the unit direction d.
    Gradient {
        /// Colour at d.y = -1.
        bottom: Vec3,
        /// Colour at d.y = +1.
        top: Vec3,
    },
}

/// A light without extent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Where it is and where it shines.
    pub kind: LightKind,
    /// I_j: colour times intensity, linear RGB.
    pub color: Vec3,
    /// A_j over distance; directional lights have none.
    pub attenuation: Attenuation,
    /// Whether things stand in its way.
    pub shadows: bool,
}

/// The kinds of light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightKind {
    /// Shines everywhere from a point.
    Point {
        /// World position.
        position: DVec3,
    },
    /// Shines into a cone.
    Spot {
        /// World position.
        position: DVec3,
        /// Axis of the cone, away from the light; unit length.
        direction: DVec3,
        /// Full angle of the cone in degrees.
        beam_angle: f64,
        /// Degrees over which the edge fades inwards; 0 is a hard edge.
        penumbra: f64,
    },
    /// Shines along one direction from infinitely far away.
    Directional {
        /// The way the light travels; unit length.
        direction: DVec3,
    },
}

/// A_j: how light weakens over the distance r, in scene units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Attenuation {
    /// 1.
    None,
    /// 1 / r^2.
    InverseSquare,
    /// 1 / (constant + linear r + quadratic r^2).
    Polynomial {
        /// k_c.
        constant: f64,
        /// k_l.
        linear: f64,
        /// k_q.
        quadratic: f64,
    },
}

/// Phong material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// c_d, linear RGB; a factor of the texel where there is a texture.
    pub diffuse: Vec3,
    /// c_s, linear RGB; zero means no specular term, and none is computed.
    pub specular: Vec3,
    /// p_r, the Phong exponent.
    pub exponent: f32,
    /// Index into [`Scene::textures`]. Only what has texture coordinates may have such a material.
    pub texture: Option<u32>,
    /// Index into [`Scene::textures`]: where the alpha of that texture is below one half, there is nothing.
    pub cutout: Option<u32>,
    /// Linear RGB, added on the front side of triangles and planes and outside of spheres; a factor of the texel where there
    /// is a texture. It lights nothing else.
    pub emission: Vec3,
    /// Index into [`Scene::textures`].
    pub emission_texture: Option<u32>,
    /// c_d is what is seen: neither lights nor shadows nor the ambient term change it, and there are no highlights.
    pub unlit: bool,
    /// The colours of a mesh's vertices, if it has any, are a factor of c_d.
    pub vertex_colors: bool,
}

impl Material {
    /// What a model without a material gets.
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

    /// Its textures, as indices into [`Scene::textures`].
    pub fn textures(&self) -> impl Iterator<Item = u32> {
        [self.texture, self.cutout, self.emission_texture].into_iter().flatten()
    }

    /// Whether it emits light of its own.
    pub fn is_emissive(&self) -> bool {
        self.emission != Vec3::ZERO
    }

    /// Whether it has a specular colour.
    pub fn is_specular(&self) -> bool {
        self.specular != Vec3::ZERO
    }

    /// Whether squaring computes the power of its highlight, so that [`ExponentPrecision`] makes no difference: whole exponents
    /// up to 256, where squaring rounds less than a logarithm does.
    pub fn has_squared_highlight(&self) -> bool {
        is_squared(self.exponent)
    }
}

/// See [`Material::has_squared_highlight`].
#[inline(always)]
pub(crate) fn is_squared(exponent: f32) -> bool {
    const MOST_SQUARED: u32 = 256;
    let whole = exponent as u32;
    whole as f32 == exponent && whole <= MOST_SQUARED
}

/// How a model's normals are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NormalMode {
    /// Interpolated between the vertices.
    Smooth,
    /// The triangle's own.
    Flat,
}

/// An instance of a compiled mesh: scaled, then rotated about x, y and z in turn, then translated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// The compiled mesh.
    pub mesh: MeshId,
    /// For each material slot of the mesh, an index into [`Scene::materials`].
    pub materials: Vec<u32>,
    /// Smooth or flat.
    pub normals: NormalMode,
    /// World position of the mesh's origin.
    pub translate: DVec3,
    /// Degrees about x, then y, then z.
    pub rotate: DVec3,
    /// Factors along the mesh's own axes; none is zero.
    pub scale: DVec3,
}

/// An analytic sphere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sphere {
    /// World position of the centre.
    pub center: DVec3,
    /// Radius in scene units, above zero.
    pub radius: f64,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// An infinite plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// Any point of it.
    pub point: DVec3,
    /// Unit normal; both sides are seen.
    pub normal: DVec3,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// A single triangle, flat.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Triangle {
    /// World positions of the corners.
    pub vertices: [DVec3; 3],
    /// Texture coordinates of the corners, whole repeats taken off as by [`crate::texture::without_repeats`].
    pub uvs: Option<[Vec2; 3]>,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// What changes from frame to frame while the scene stays: under 200 bytes on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameView {
    /// The eye of this frame.
    pub camera: Camera,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Rays per pixel, a square number.
    pub samples: u32,
    /// Degrees by which every model is turned about the +Y axis through its own origin, after its own rotation.
    pub spin: f64,
    /// What may be left out or done more roughly.
    pub quality: Quality,
}

impl FrameView {
    /// Whether samples are left out where neighbours do not differ.
    pub fn is_adaptive(&self) -> bool {
        self.quality.adaptive && self.samples > 1
    }

    /// The frame that the scene file itself asks for, at full scale.
    pub fn of(scene: &Scene) -> Self {
        let RenderSettings { width, height, samples, quality, .. } = scene.render;
        Self { camera: scene.camera, width, height, samples, spin: 0.0, quality }
    }
}
