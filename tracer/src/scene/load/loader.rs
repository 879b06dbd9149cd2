//! Repeated loading of a scene while it is edited.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::cache::FileCache;
use super::limits::LoadLimits;
use super::textures::PictureUse;
use super::{LoadedScene, model, scene_file};
use crate::files::FileStamp;
use crate::mesh::CompiledMesh;
use crate::scene::import::{Kind, LoadOptions, SceneError, Uvs};
use crate::texture::Texture;

/// Models of scene files, with the warnings about them.
pub(super) type ModelCache = FileCache<ModelKey, (Arc<CompiledMesh>, Vec<String>)>;

/// Pictures, with the notes about them.
pub(super) type PictureCache = FileCache<(PathBuf, PictureUse), (Arc<Texture>, Vec<String>)>;

/// Everything on which the mesh of a model file depends.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ModelKey {
    /// Real path of the file.
    pub(super) path: PathBuf,
    /// Bits of the crease angle in degrees.
    pub(super) crease_angle: Option<u64>,
    pub(super) normals: bool,
    pub(super) uvs: Uvs,
}

/// The files of a scene that were read, compiled or decoded before. Clones are handles to the same files.
#[derive(Clone, Debug, Default)]
pub(super) struct Caches {
    pub(super) models: ModelCache,
    pub(super) pictures: PictureCache,
}

/// Loads scenes with the same options repeatedly. Models and pictures are reused, also by a clone, while the size and the
/// time of the last change of their files are the same.
#[derive(Clone, Debug, Default)]
pub struct SceneLoader {
    options: LoadOptions,
    limits: LoadLimits,
    caches: Caches,
    /// State of the scene or bare model that was loaded last, before it was read.
    main: Option<FileStamp>,
}

impl SceneLoader {
    /// A loader that has not loaded anything.
    pub fn new(options: LoadOptions, limits: LoadLimits) -> Self {
        Self { options, limits, ..Self::default() }
    }

    /// The loader with other options and the same files.
    #[must_use]
    pub fn with_options(self, options: LoadOptions) -> Self {
        Self { options, ..self }
    }

    /// Loads a scene file or a model, as [`load`](fn@super::load) does.
    ///
    /// # Errors
    /// As [`load`](fn@super::load).
    pub fn load(&mut self, path: &Path) -> Result<LoadedScene, SceneError> {
        self.begin(path);
        let loaded = match Kind::of(path)? {
            Kind::Scene => scene_file::load(path, self.options, self.limits, &self.caches)?,
            Kind::Obj | Kind::Compiled => model::load_bare(path, self.options, self.limits, &self.caches)?,
        };
        checked(path, loaded)
    }

    /// Loads the text of a scene file as if it were at `path`: messages name that path, and other files are relative to it.
    /// There need not be a file.
    ///
    /// # Errors
    /// As [`load`](fn@super::load).
    pub fn load_text(&mut self, path: &Path, text: &str) -> Result<LoadedScene, SceneError> {
        self.begin(path);
        checked(path, scene_file::load_text(path, text, self.options, self.limits, &self.caches)?)
    }

    /// The files that the last load has read, or has tried to read, with their state before that, also if it failed. A file
    /// that was read for an earlier load is among them if the last one has used it.
    pub fn files(&self) -> Vec<FileStamp> {
        let named = self.main.iter().cloned();
        named.chain(self.caches.models.files()).chain(self.caches.pictures.files()).collect()
    }

    fn begin(&mut self, path: &Path) {
        self.main = Some(FileStamp::of(path));
        self.caches.models.begin_load();
        self.caches.pictures.begin_load();
    }
}

/// A loaded scene whose numbers are in range.
fn checked(path: &Path, loaded: LoadedScene) -> Result<LoadedScene, SceneError> {
    loaded.scene.validate().map_err(|fault| SceneError::in_file(path, fault.to_string()))?;
    Ok(loaded)
}
