//! The scene: plain data, checks, quality knobs, and import from files.
//!
//! A [`Scene`] refers to its meshes by hash ([`MeshId`](crate::mesh::MeshId)) and to its materials by index, so it serialises
//! to a few kilobytes whatever it contains. Positions and transforms are `f64`: a scene may be 10^7 extents away from the
//! origin, and digits are dropped only after the camera's position has been subtracted. Colours are linear RGB.
//!
//! Import needs the feature `import`: [`load`](fn@load) reads a scene file (`toml`) or a model (`import`).

#[cfg(feature = "import")]
mod animation;
mod data;
#[cfg(feature = "import")]
mod import;
pub mod knobs;
#[cfg(feature = "import")]
mod load;
#[cfg(feature = "import")]
mod toml;
mod validate;

#[cfg(feature = "import")]
pub use animation::CameraPath;
pub use data::{
    Attenuation, Background, Camera, CameraKind, Disk, FovAxis, FrameView, Integrator, Lens, Light,
    LightKind, Model, Motion, NormalMode, PathSettings, PixelFormat, Plane, RenderSettings, Sampler, Scene,
    SceneFeatures, Sky, SkyPicture, Sphere, ToneCurve, ToneMapping, Triangle, Volume, VolumeBoundary,
};
#[cfg(feature = "import")]
pub use import::{DEFAULT_CREASE_ANGLE, LoadOptions, SceneError, Up};
pub use knobs::{ColorDepth, ExponentPrecision, Quality, RenderScale, Setting, Shading};
#[cfg(feature = "import")]
pub use load::{
    LoadLimits, LoadedScene, SceneAnimation, SceneLoader, compile_model, compile_model_with, load,
    load_limited, load_with,
};
pub use validate::{
    MAX_CLAMP, MAX_COORDINATE, MAX_DEPTH, MAX_DISKS, MAX_EXPOSURE, MAX_IOR, MAX_LIGHT, MAX_LIGHTS,
    MAX_MATERIALS, MAX_MODELS, MAX_NORMAL_STRENGTH, MAX_PATH_SAMPLES, MAX_PLANES, MAX_SAMPLES,
    MAX_SHADOW_SAMPLES, MAX_SLOTS, MAX_SPHERES, MAX_TEXTURES, MAX_TRIANGLES, MAX_VOLUMES, ValidateError,
};

pub(crate) use crate::material::is_squared;
pub use crate::material::{Checker, CheckerSpace, MAX_EXPONENT, Material, MetallicRoughness, NormalMap};
pub use crate::rotation;
pub use crate::texture::{Filter, MAX_TILING, TextureMap, Tiling, Wrap};
