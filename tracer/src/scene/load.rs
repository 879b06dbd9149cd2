//! From a path to a scene that is ready: files read, models compiled, everything that is left open decided.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::file::TextureText;
use super::file::{self, Aim, CameraText, ModelText, SceneText};
use super::obj::Uvs;
use super::read::{Kind, MAX_MODEL_BYTES, MAX_SCENE_BYTES, bytes};
use super::textures::Textures;
use super::{Camera, Material, Model, NormalMode, Scene, SceneError, framing, obj};
use crate::mesh::{CompileOptions, CompiledMesh, MeshId, MeshReport};
use crate::texture::Texture;

/// A scene, and the meshes and textures it names.
#[derive(Debug)]
pub struct LoadedScene {
    /// What to draw.
    pub scene: Scene,
    /// Every mesh of the scene, once.
    pub meshes: Vec<Arc<CompiledMesh>>,
    /// Every texture of the scene, once.
    pub textures: Vec<Arc<Texture>>,
    /// What was accepted although it looks unintended, ready to be shown, each with its place.
    pub warnings: Vec<String>,
}

/// Loads a scene: a scene file (`.toml`), or a model (`.obj`, or a compiled one) as a scene by itself, framed by a
/// camera that shows all of it.
///
/// # Errors
/// What is wrong with the file or one it names; the message has the place and what was expected there.
pub fn load(path: &Path) -> Result<LoadedScene, SceneError> {
    let loaded = match Kind::of(path)? {
        Kind::Scene => load_scene_file(path)?,
        Kind::Obj | Kind::Compiled => load_bare_model(path)?,
    };
    loaded.scene.validate().map_err(|fault| SceneError::in_file(path, fault.to_string()))?;
    Ok(loaded)
}

/// Loads and compiles a model, or takes a compiled one as it is, to be kept in a file in `folder`: with all that a scene
/// may ask of it, and with the pictures of its materials named as they are seen from there. With it come warnings.
///
/// # Errors
/// As [`load`].
pub fn compile_model(
    path: &Path,
    folder: &Path,
    options: CompileOptions,
) -> Result<(Arc<CompiledMesh>, Vec<String>), SceneError> {
    let (mesh, warnings) = load_model(path, options, Uvs::Always)?;
    let from = path.parent().unwrap_or(Path::new(""));
    let moved = super::moved::texture_names(&mesh, from, folder)
        .map_err(|source| SceneError::Mesh { path: path.to_owned(), source })?;
    Ok((moved.map_or(mesh, Arc::new), warnings))
}

fn load_bare_model(path: &Path) -> Result<LoadedScene, SceneError> {
    let (mesh, mut warnings) = load_model(path, CompileOptions::default(), Uvs::Textured)?;
    let mut scene = framing::bare_model(&mesh);
    let mut textures = Textures::default();
    scene.materials = textures.of_model(path, &mesh, &mut warnings);
    let (maps, textures) = textures.into_parts();
    scene.textures = maps;
    Ok(LoadedScene { scene, meshes: vec![mesh], textures, warnings })
}

fn load_model(
    path: &Path,
    options: CompileOptions,
    uvs: Uvs,
) -> Result<(Arc<CompiledMesh>, Vec<String>), SceneError> {
    let failed = |source| SceneError::Mesh { path: path.to_owned(), source };
    match Kind::of(path)? {
        Kind::Scene => Err(SceneError::in_file(path, "a scene file, where a model was expected")),
        Kind::Compiled => {
            let mesh = CompiledMesh::from_bytes(&bytes(path, MAX_MODEL_BYTES)?).map_err(failed)?;
            Ok((Arc::new(mesh), Vec::new()))
        }
        Kind::Obj => {
            let (mesh, mut warnings) = obj::load(path, uvs)?;
            let (compiled, report) = CompiledMesh::compile_with(&mesh, options).map_err(failed)?;
            warnings.extend(describe(path, report));
            Ok((Arc::new(compiled), warnings))
        }
    }
}

fn describe(path: &Path, report: MeshReport) -> Option<String> {
    let MeshReport { dropped_degenerate, dropped_duplicate, dropped_not_finite } = report;
    (report.dropped() > 0).then(|| {
        format!(
            "{}: triangles left out: {dropped_degenerate} without an area, {dropped_duplicate} that repeat another, \
             {dropped_not_finite} not finite",
            path.display()
        )
    })
}

fn load_scene_file(path: &Path) -> Result<LoadedScene, SceneError> {
    let content = bytes(path, MAX_SCENE_BYTES)?;
    let text = text_of(path, &content)?;
    let complain = |fault: file::Fault| {
        let (line, column) = file::place(text, fault.at);
        SceneError::InScene { path: path.to_owned(), line, column, message: fault.message }
    };
    let read = file::read(text).map_err(complain)?;
    let mut warnings: Vec<String> = read.warnings.iter().cloned().map(|w| complain(w).to_string()).collect();
    let mut models = Models::open(path, &read.models, &read.textures).map_err(complain)?;
    let mut loaded = assemble(path, read, &mut models, &complain)?;
    warnings.append(&mut models.warnings);
    loaded.warnings = warnings;
    Ok(loaded)
}

fn text_of<'b>(path: &Path, content: &'b [u8]) -> Result<&'b str, SceneError> {
    std::str::from_utf8(content).map_err(|e| {
        let before = String::from_utf8_lossy(content.get(..e.valid_up_to()).unwrap_or_default());
        let (line, column) = file::place(&before, before.len());
        let message = "not valid UTF-8: save the scene file in that encoding".to_owned();
        SceneError::InScene { path: path.to_owned(), line, column, message }
    })
}

/// Puts the parts together and decides what the file left open.
fn assemble(
    path: &Path,
    text: SceneText,
    models: &mut Models,
    complain: &impl Fn(file::Fault) -> SceneError,
) -> Result<LoadedScene, SceneError> {
    let mut scene = Scene {
        ambient: text.ambient,
        render: text.render,
        camera: framing::camera_showing(None),
        background: text.background,
        lights: text.lights,
        materials: text.materials,
        textures: Vec::new(),
        models: Vec::new(),
        spheres: text.spheres,
        planes: text.planes,
        triangles: text.triangles,
    };
    for model in &text.models {
        let instance = models.instance(model, &mut scene.materials, &text.textures, complain)?;
        scene.models.push(instance);
    }
    load_textures(&models.folder, &text.textures, &mut scene, &mut models.textures).map_err(complain)?;
    let (maps, textures) = std::mem::take(&mut models.textures).into_parts();
    scene.textures = maps;
    let meshes = models.take_meshes();
    let bounds = framing::bounds(&scene, &meshes);
    scene.camera = match text.camera {
        Some(camera) => aimed(camera, bounds),
        None if bounds.is_none() => {
            let message = "[camera] is missing, and nothing finite is there to be framed; add one with `position` and `look_at`";
            return Err(SceneError::in_file(path, message));
        }
        None => framing::camera_showing(bounds),
    };
    if scene.lights.is_empty() {
        scene.lights.push(framing::default_light(&scene.camera));
    }
    Ok(LoadedScene { scene, meshes, textures, warnings: Vec::new() })
}

/// Textures of the scene file's own materials, as far as something has them.
fn load_textures(
    folder: &Path,
    texts: &BTreeMap<u32, TextureText>,
    scene: &mut Scene,
    textures: &mut Textures,
) -> Result<(), file::Fault> {
    let of_models = scene.models.iter().flat_map(|model| model.materials.iter().copied());
    let used: BTreeSet<u32> =
        of_models.chain(scene.triangles.iter().map(|triangle| triangle.material)).collect();
    for (index, text) in texts.iter().filter(|(index, _)| used.contains(index)) {
        let texture = textures.add(&folder.join(&text.file), text.filter);
        let texture = texture.map_err(|reason| file::Fault {
            at: text.at,
            message: format!("the texture: {reason} (paths are relative to the scene file)"),
        })?;
        if let Some(material) = scene.materials.get_mut(*index as usize) {
            material.texture = Some(texture);
        }
    }
    Ok(())
}

/// The camera with the point that it looks at.
fn aimed(text: CameraText, bounds: Option<framing::Bounds>) -> Camera {
    let CameraText { position, aim, up, fov, zoom } = text;
    let look_at = match aim {
        Aim::Point(point) => point,
        Aim::Direction(direction) => framing::point_on_axis(position, direction, bounds),
    };
    Camera { position, look_at, up, fov, zoom }
}

/// The models of a scene file: each file is loaded and compiled once, however often and by whatever path it is named.
struct Models {
    /// The real path of each file that the scene names.
    paths: BTreeMap<PathBuf, PathBuf>,
    /// Where the names in the scene file begin.
    folder: PathBuf,
    /// Real paths of the files that some instance shows smoothly.
    smooth: BTreeSet<PathBuf>,
    /// By real path: what the instances of a file need of its texture coordinates.
    uvs: BTreeMap<PathBuf, Uvs>,
    textures: Textures,
    loaded: BTreeMap<PathBuf, LoadedModel>,
    warnings: Vec<String>,
}

struct LoadedModel {
    /// As messages name it.
    path: PathBuf,
    mesh: Arc<CompiledMesh>,
    /// Where the scene's materials hold the file's own, once an instance has asked for them.
    own_materials: Option<Vec<u32>>,
}

impl Models {
    /// Finds every file, so that a missing one is told with its place in the scene file before work begins.
    fn open(
        scene: &Path,
        models: &[ModelText],
        textures: &BTreeMap<u32, TextureText>,
    ) -> Result<Self, file::Fault> {
        let folder = scene.parent().unwrap_or(Path::new(""));
        let mut all = Self {
            paths: BTreeMap::new(),
            folder: folder.to_owned(),
            smooth: BTreeSet::new(),
            uvs: BTreeMap::new(),
            textures: Textures::default(),
            loaded: BTreeMap::new(),
            warnings: Vec::new(),
        };
        for model in models {
            let path = folder.join(&model.file);
            let real = path.canonicalize().map_err(|e| file::Fault {
                at: model.at,
                message: format!(
                    "cannot read the model {}: {e} (paths are relative to the scene file)",
                    path.display()
                ),
            })?;
            if model.normals == NormalMode::Smooth {
                all.smooth.insert(real.clone());
            }
            let wanted = match model.material {
                None => Uvs::Textured,
                Some(material) if textures.contains_key(&material) => Uvs::Always,
                Some(_) => Uvs::Never,
            };
            let most = all.uvs.entry(real.clone()).or_insert(wanted);
            *most = wanted.max(*most);
            all.paths.insert(model.file.clone(), real);
        }
        Ok(all)
    }

    fn instance(
        &mut self,
        text: &ModelText,
        materials: &mut Vec<Material>,
        textures: &BTreeMap<u32, TextureText>,
        complain: &impl Fn(file::Fault) -> SceneError,
    ) -> Result<Model, SceneError> {
        let real = self.paths.get(&text.file).unwrap_or(&text.file).clone();
        let loaded = match self.loaded.entry(real) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                let normals = self.smooth.contains(entry.key());
                let uvs = self.uvs.get(entry.key()).copied().unwrap_or(Uvs::Never);
                // Messages name the file as the user does.
                let path = self.folder.join(&text.file);
                let options = CompileOptions { normals, ..CompileOptions::default() };
                let (mesh, warnings) = load_model(&path, options, uvs)?;
                self.warnings.extend(warnings);
                entry.insert(LoadedModel { path, mesh, own_materials: None })
            }
        };
        let slots = match text.material {
            Some(material) if textures.contains_key(&material) && !loaded.mesh.has_uvs() => {
                return Err(complain(without_uvs(text)));
            }
            Some(material) => vec![material; loaded.mesh.material_count()],
            None => loaded.own_materials(materials, &mut self.textures, &mut self.warnings),
        };
        Ok(Model {
            mesh: loaded.mesh.id(),
            materials: slots,
            normals: text.normals,
            translate: text.translate,
            rotate: text.rotate,
            scale: text.scale,
        })
    }

    /// Files with the same content are one mesh.
    fn take_meshes(&mut self) -> Vec<Arc<CompiledMesh>> {
        let loaded = std::mem::take(&mut self.loaded);
        let by_id: BTreeMap<MeshId, Arc<CompiledMesh>> =
            loaded.into_values().map(|model| (model.mesh.id(), model.mesh)).collect();
        by_id.into_values().collect()
    }
}

impl LoadedModel {
    fn own_materials(
        &mut self,
        materials: &mut Vec<Material>,
        textures: &mut Textures,
        warnings: &mut Vec<String>,
    ) -> Vec<u32> {
        self.own_materials
            .get_or_insert_with(|| {
                let first = materials.len() as u32;
                materials.extend(textures.of_model(&self.path, &self.mesh, warnings));
                (first..materials.len() as u32).collect()
            })
            .clone()
    }
}

/// A texture of the scene file on a model that has no place for it.
fn without_uvs(text: &ModelText) -> file::Fault {
    let message = format!(
        "`material` in [[model]] has a texture, but {} has no texture coordinates (`vt`); \
         write it with them, or use a material with a colour",
        text.file.display()
    );
    file::Fault { at: text.material_at, message }
}

#[cfg(test)]
mod tests;
