//! The models of `[[model]]` and `[[volume]]` tables of a scene file: each file is loaded once, each table becomes an instance.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::limits::LoadLimits;
use super::loader::{Caches, ModelCache, ModelKey};
use super::model::load_model;
use super::textures::Textures;
use crate::files::FileStamp;
use crate::material::Material;
use crate::mesh::{CompileOptions, CompiledMesh, MeshId};
use crate::scene::data::{Model, NormalMode};
use crate::scene::import::{Kind, LoadOptions, SceneError, Uvs};
use crate::scene::toml::{Fault, ModelText, TexturesText};

/// The models of a scene file. Each file is loaded and compiled once, whatever the number of its instances and paths.
pub(super) struct Models {
    /// Real paths by the names in the scene file.
    paths: BTreeMap<PathBuf, PathBuf>,
    /// Folder of the scene file, the base of relative names.
    pub(super) folder: PathBuf,
    pub(super) options: LoadOptions,
    limits: LoadLimits,
    /// Real paths of the files with a smooth instance.
    smooth: BTreeSet<PathBuf>,
    /// By real path: the texture coordinates that the instances of a file need.
    uvs: BTreeMap<PathBuf, Uvs>,
    pub(super) textures: Textures,
    cache: ModelCache,
    /// By real path and crease angle.
    loaded: BTreeMap<(PathBuf, Option<u64>), LoadedModel>,
    /// Material slots of all instances so far.
    slots: usize,
    pub(super) warnings: Vec<String>,
}

/// The materials of a scene file whose textures have not been loaded.
#[derive(Clone, Copy)]
pub(super) struct MaterialsText<'t> {
    pub(super) materials: &'t [Material],
    /// By the index of the material.
    pub(super) textures: &'t BTreeMap<u32, TexturesText>,
}

impl MaterialsText<'_> {
    /// The texture coordinates that a model with this material needs.
    fn uvs(&self, material: u32) -> Uvs {
        let in_uvs = |material: &Material| material.needs_uvs();
        let texts = self.textures.get(&material);
        if self.materials.get(material as usize).is_some_and(in_uvs)
            || texts.is_some_and(TexturesText::distinguish_repeats)
        {
            return Uvs::Whole;
        }
        if texts.is_some() { Uvs::Always } else { Uvs::Never }
    }
}

/// A compiled model of a scene file.
struct LoadedModel {
    /// Path for messages.
    path: PathBuf,
    mesh: Arc<CompiledMesh>,
    /// Indices of the file's own materials in the scene, once an instance uses them.
    own_materials: Option<Vec<u32>>,
}

impl Models {
    /// Resolves all files, so that a missing one is reported with its place in the scene file before any is loaded.
    pub(super) fn open<'t>(
        scene: &Path,
        models: impl Iterator<Item = &'t ModelText>,
        materials: MaterialsText<'_>,
        (options, limits): (LoadOptions, LoadLimits),
        caches: &Caches,
    ) -> Result<Self, Fault> {
        let folder = scene.parent().unwrap_or(Path::new(""));
        let mut all = Self {
            paths: BTreeMap::new(),
            folder: folder.to_owned(),
            options,
            limits,
            smooth: BTreeSet::new(),
            uvs: BTreeMap::new(),
            textures: Textures::with_cache(limits.texture_bytes, &caches.pictures),
            cache: caches.models.clone(),
            loaded: BTreeMap::new(),
            slots: 0,
            warnings: Vec::new(),
        };
        for model in models {
            let path = named(folder, &model.file);
            all.cache.note(FileStamp::of(&path));
            let real = path.canonicalize().map_err(|e| Fault {
                at: model.at,
                message: format!(
                    "cannot read the model {}: {e} (paths are relative to the scene file)",
                    path.display()
                ),
            })?;
            if model.normals == NormalMode::Smooth {
                all.smooth.insert(real.clone());
            }
            let wanted = model.material.map_or(Uvs::Textured, |material| materials.uvs(material));
            let most = all.uvs.entry(real.clone()).or_insert(wanted);
            *most = wanted.max(*most);
            all.paths.insert(model.file.clone(), real);
        }
        Ok(all)
    }

    /// The instance that a `[[model]]` describes. The model is loaded and compiled when its first instance is.
    pub(super) fn instance(
        &mut self,
        text: &ModelText,
        materials: &mut Vec<Material>,
        textures: &BTreeMap<u32, TexturesText>,
        locate: &impl Fn(Fault) -> SceneError,
    ) -> Result<Model, SceneError> {
        let real = self.paths.get(&text.file).unwrap_or(&text.file).clone();
        let crease_angle = text.crease_angle.map(|(degrees, _)| degrees);
        let loaded = match self.loaded.entry((real, crease_angle.map(f64::to_bits))) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                let (real, _) = entry.key();
                let normals = self.smooth.contains(real);
                let uvs = self.uvs.get(real).copied().unwrap_or(Uvs::Never);
                // Messages name the file as the scene file does.
                let path = named(&self.folder, &text.file);
                let compile = CompileOptions { normals, ..CompileOptions::default() };
                let crease_angle = match text.crease_angle {
                    Some((_, at)) if Kind::of(&path)? == Kind::Compiled => {
                        let message = "`crease_angle` in [[model]] has no effect: a compiled model has its normals; \
                                       give --crease-angle to `rayfarm-master compile`";
                        self.warnings.push(locate(Fault { at, message: message.into() }).to_string());
                        None
                    }
                    _ => crease_angle,
                };
                let options = LoadOptions { crease_angle, ..self.options };
                let bits = crease_angle.map(f64::to_bits);
                let key = ModelKey { path: real.clone(), crease_angle: bits, normals, uvs };
                let load = |files: &mut Vec<FileStamp>| load_model(&path, compile, uvs, options, files);
                let (mesh, warnings) = self.cache.get_or_read(key, load)?;
                self.warnings.extend(warnings);
                entry.insert(LoadedModel { path, mesh, own_materials: None })
            }
        };
        self.slots += loaded.mesh.material_count();
        if self.slots > self.limits.material_slots {
            let most_slots = self.limits.material_slots;
            return Err(locate(Fault {
                at: text.at,
                message: format!(
                    "the models up to here have {} materials in all, each counted once for each instance; \
                     at most {most_slots} are allowed",
                    self.slots
                ),
            }));
        }
        let needs_uvs = |material: u32, materials: &[Material]| {
            textures.contains_key(&material)
                || materials.get(material as usize).is_some_and(Material::needs_uvs)
        };
        let slots = match text.material {
            Some(material) if needs_uvs(material, materials) && !loaded.mesh.has_uvs() => {
                return Err(locate(without_uvs(text)));
            }
            Some(material) => vec![material; loaded.mesh.material_count()],
            None => loaded.own_materials(
                materials,
                &mut self.textures,
                self.options.allow_parent_textures,
                &mut self.warnings,
            ),
        };
        Ok(Model {
            mesh: loaded.mesh.id(),
            materials: slots,
            // A mesh that is flat everywhere carries no normals.
            normals: if loaded.mesh.has_normals() { text.normals } else { NormalMode::Flat },
            translate: text.translate,
            rotate: text.rotate,
            scale: text.scale,
            group: text.group,
        })
    }

    /// The closed mesh that bounds a volume, placed. The model is loaded and compiled unless an instance of it is.
    pub(super) fn boundary(
        &mut self,
        text: &ModelText,
        locate: &impl Fn(Fault) -> SceneError,
    ) -> Result<Model, SceneError> {
        // Its one material is none of the scene's: it is not seen.
        let model = self.instance(text, &mut Vec::new(), &BTreeMap::new(), locate)?;
        Ok(Model { materials: Vec::new(), ..model })
    }

    /// All meshes. Files with the same content are one mesh.
    pub(super) fn take_meshes(&mut self) -> Vec<Arc<CompiledMesh>> {
        let loaded = std::mem::take(&mut self.loaded);
        let by_id: BTreeMap<MeshId, Arc<CompiledMesh>> =
            loaded.into_values().map(|model| (model.mesh.id(), model.mesh)).collect();
        by_id.into_values().collect()
    }
}

impl LoadedModel {
    /// Indices of the file's own materials, which are added to the scene at the first call.
    fn own_materials(
        &mut self,
        materials: &mut Vec<Material>,
        textures: &mut Textures,
        may_leave: bool,
        warnings: &mut Vec<String>,
    ) -> Vec<u32> {
        self.own_materials
            .get_or_insert_with(|| {
                let first = materials.len() as u32;
                materials.extend(textures.of_model(&self.path, &self.mesh, may_leave, warnings));
                (first..materials.len() as u32).collect()
            })
            .clone()
    }
}

/// Path of a file that the scene file names. Back slashes are separators unless a file of that very name exists.
pub(super) fn named(folder: &Path, file: &Path) -> PathBuf {
    let path = folder.join(file);
    match file.to_str().filter(|name| name.contains('\\') && !path.exists()) {
        Some(name) => folder.join(name.replace('\\', "/")),
        None => path,
    }
}

/// The fault of a textured material on a model without texture coordinates.
fn without_uvs(text: &ModelText) -> Fault {
    let message = format!(
        "`material` in [[model]] has a texture or a pattern laid in texture coordinates, but {} has no texture coordinates (`vt`); \
         write it with them, or use a material with a colour",
        text.file.display()
    );
    Fault { at: text.material_at, message }
}
