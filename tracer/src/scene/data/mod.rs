//! The scene as plain data: no file handles, no acceleration structures, nothing derived.

mod features;
mod integrator;
mod lens;
mod light;
mod motion;
mod objects;
mod picture;
mod quality;
mod scale;
mod setting;
mod view;
mod volume;

use glam::Vec3;
use serde::{Deserialize, Serialize};

pub use features::SceneFeatures;
pub use integrator::{Integrator, PathSettings, Sampler};
pub use lens::Lens;
pub use light::{Attenuation, Light, LightKind};
pub use motion::Motion;
pub use objects::{Disk, Model, NormalMode, Plane, Sphere, Triangle};
pub use picture::{PixelFormat, ToneCurve, ToneMapping};
pub use quality::{ColorDepth, ExponentPrecision, Quality, Shading, word_of};
pub use scale::RenderScale;
pub use setting::Setting;
pub use view::{Background, Camera, CameraKind, FovAxis, FrameView, RenderSettings, Sky, SkyPicture};
pub use volume::{Volume, VolumeBoundary};

use crate::material::Material;
use crate::texture::TextureMap;

/// A whole scene, with every reference resolved to an index or a hash.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// I_a, linear RGB, added once per hit, times the diffuse colour.
    pub ambient: Vec3,
    /// Picture size and sampling; the command line may override them.
    pub render: RenderSettings,
    /// Initial camera.
    pub camera: Camera,
    /// The camera's lens.
    pub lens: Lens,
    /// Radiance of rays that hit nothing.
    pub background: Background,
    /// Whether rays of the camera see the background; without, they see black. Reflected and transmitted rays see it always.
    pub background_visible: bool,
    /// Lights; never empty after loading (a scene without one gets the default light).
    pub lights: Vec<Light>,
    /// Whether the lights are the default one. Paths leave it out in scenes that emit light or have a sky.
    pub has_default_light: bool,
    /// Materials; the range of every material index of the scene.
    pub materials: Vec<Material>,
    /// Textures; the range of every texture index of the materials.
    pub textures: Vec<TextureMap>,
    /// Instances of compiled meshes.
    pub models: Vec<Model>,
    /// Analytic spheres.
    pub spheres: Vec<Sphere>,
    /// Flat disks.
    pub disks: Vec<Disk>,
    /// Infinite planes.
    pub planes: Vec<Plane>,
    /// Single triangles of the scene file.
    pub triangles: Vec<Triangle>,
    /// Volumes that scatter light; only the path integrator has them.
    pub volumes: Vec<Volume>,
    /// Objects that move while the shutter is open, each at most once; only the path integrator moves them.
    pub motions: Vec<Motion>,
}

impl Scene {
    /// The scene with its materials as the direct integrator shows them; `None` where all are shown as they are.
    pub(crate) fn shown_directly(&self) -> Option<Self> {
        let is_converted = |material: &Material| material.metallic_roughness.is_some();
        self.materials.iter().any(is_converted).then(|| {
            let materials = self.materials.iter().map(Material::shown_directly).collect();
            Self { materials, ..self.clone() }
        })
    }
}

impl Default for Scene {
    /// A scene without any object or light, with a black background.
    fn default() -> Self {
        Self {
            ambient: Vec3::ZERO,
            render: RenderSettings::default(),
            camera: Camera::default(),
            lens: Lens::default(),
            background: Background::Color(Vec3::ZERO),
            background_visible: true,
            lights: Vec::new(),
            has_default_light: false,
            materials: Vec::new(),
            textures: Vec::new(),
            models: Vec::new(),
            spheres: Vec::new(),
            disks: Vec::new(),
            planes: Vec::new(),
            triangles: Vec::new(),
            volumes: Vec::new(),
            motions: Vec::new(),
        }
    }
}
