//! Loading of complete scenes: files are read, models compiled, and everything that a file leaves open is decided.

mod animated;
mod background;
mod cache;
mod framing;
mod instances;
mod limits;
mod loader;
mod model;
mod moved;
mod scene_file;
mod sky;
mod textures;

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use animated::SceneAnimation;
pub use limits::LoadLimits;
pub use loader::SceneLoader;
pub use model::{compile_model, compile_model_with};

use super::data::Scene;
use super::import::{LoadOptions, SceneError};
use crate::mesh::CompiledMesh;
use crate::texture::Texture;

/// A scene with all meshes and textures that it refers to.
#[derive(Debug)]
pub struct LoadedScene {
    /// Loaded scene.
    pub scene: Scene,
    /// Every mesh of the scene, once.
    pub meshes: Vec<Arc<CompiledMesh>>,
    /// For each mesh its first source file, as the scene file names it.
    pub mesh_files: Vec<PathBuf>,
    /// Every texture of the scene, once.
    pub textures: Vec<Arc<Texture>>,
    /// Movements of the scene over frames, if it has any. The scene is as it is at time 0, but for the camera: see
    /// [`SceneAnimation::camera`].
    pub animation: Option<SceneAnimation>,
    /// Messages about accepted input that is probably a mistake, each with its place.
    pub warnings: Vec<String>,
}

/// Loads a scene file (`.toml`), or a model (`.obj`, or a compiled one) as a scene of its own, with a camera that shows all
/// of it.
///
/// # Errors
/// A fault of the file or of a file that it names; the message has the place and what was expected there.
pub fn load(path: &Path) -> Result<LoadedScene, SceneError> {
    load_with(path, LoadOptions::default())
}

/// [`load`] with options.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, options: LoadOptions) -> Result<LoadedScene, SceneError> {
    load_limited(path, options, LoadLimits::default())
}

/// [`load`] with options and limits.
///
/// # Errors
/// As [`load`].
pub fn load_limited(
    path: &Path,
    options: LoadOptions,
    limits: LoadLimits,
) -> Result<LoadedScene, SceneError> {
    SceneLoader::new(options, limits).load(path)
}
