//! From a path to a scene that is ready: files read, models compiled, everything that is left open decided.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::file::{self, Aim, CameraText, ModelText, SceneText, TextureText, TexturesText};
use super::obj::Uvs;
use super::read::{Kind, MAX_MODEL_BYTES, MAX_SCENE_BYTES, bytes};
use super::textures::Textures;
use super::{Camera, LoadOptions, Material, Model, NormalMode, Scene, SceneError, Up, framing, obj};
use crate::mesh::{CompileOptions, CompiledMesh, Mesh, MeshId, MeshReport};
use crate::texture::Texture;

/// A scene, and the meshes and textures it names.
#[derive(Debug)]
pub struct LoadedScene {
    /// What to draw.
    pub scene: Scene,
    /// Every mesh of the scene, once.
    pub meshes: Vec<Arc<CompiledMesh>>,
    /// For each mesh the first file that it comes from, as the scene names it.
    pub mesh_files: Vec<PathBuf>,
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
    load_with(path, LoadOptions::default())
}

/// As [`load`], with what the user says about the files.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, options: LoadOptions) -> Result<LoadedScene, SceneError> {
    let loaded = match Kind::of(path)? {
        Kind::Scene => load_scene_file(path, options)?,
        Kind::Obj | Kind::Compiled => load_bare_model(path, options)?,
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
    compile: CompileOptions,
) -> Result<(Arc<CompiledMesh>, Vec<String>), SceneError> {
    compile_model_with(path, folder, compile, LoadOptions::default())
}

/// As [`compile_model`], with what the user says about the files.
///
/// # Errors
/// As [`load`].
pub fn compile_model_with(
    path: &Path,
    folder: &Path,
    compile: CompileOptions,
    options: LoadOptions,
) -> Result<(Arc<CompiledMesh>, Vec<String>), SceneError> {
    let (mesh, mut warnings) = load_model(path, compile, Uvs::Whole, options)?;
    let from = path.parent().unwrap_or(Path::new(""));
    let moved = super::moved::texture_names(&mesh, from, folder)
        .map_err(|source| SceneError::Mesh { path: path.to_owned(), source })?;
    let mesh = moved.map_or(mesh, Arc::new);
    if super::moved::leads_out(&mesh) {
        warnings.push(format!(
            "{}: the pictures of its materials are outside of the folder of the compiled model, which shows them with \
             --allow-parent-textures only; compile it into the folder of the model",
            path.display()
        ));
    }
    Ok((mesh, warnings))
}

fn load_bare_model(path: &Path, options: LoadOptions) -> Result<LoadedScene, SceneError> {
    // The instance is turned upright, so that compiled models can be.
    let as_it_is = LoadOptions { up: None, ..options };
    let (mesh, mut warnings) = load_model(path, CompileOptions::default(), Uvs::Textured, as_it_is)?;
    let mut scene = framing::bare_model(&mesh, options.up.unwrap_or_default(), options.size);
    let mut textures = Textures::default();
    scene.materials = textures.of_model(path, &mesh, options.allow_parent_textures, &mut warnings);
    let (maps, textures, notes) = textures.into_parts();
    scene.textures = maps;
    warnings.extend(notes);
    let mesh_files = vec![path.to_owned()];
    Ok(LoadedScene { scene, meshes: vec![mesh], mesh_files, textures, warnings })
}

fn load_model(
    path: &Path,
    compile: CompileOptions,
    uvs: Uvs,
    options: LoadOptions,
) -> Result<(Arc<CompiledMesh>, Vec<String>), SceneError> {
    let failed = |source| SceneError::Mesh { path: path.to_owned(), source };
    match Kind::of(path)? {
        Kind::Scene => Err(SceneError::in_file(path, "a scene file, where a model was expected")),
        Kind::Compiled => {
            refuse_for_compiled(path, options)?;
            let mesh = CompiledMesh::from_bytes(&bytes(path, MAX_MODEL_BYTES)?).map_err(failed)?;
            Ok((Arc::new(mesh), Vec::new()))
        }
        Kind::Obj => {
            let (mut mesh, mut warnings) = obj::load(path, uvs, options)?;
            turn_upright(&mut mesh, options.up.unwrap_or_default());
            let (compiled, report) = CompiledMesh::compile_with(&mesh, compile).map_err(failed)?;
            warnings.extend(describe(path, report));
            Ok((Arc::new(compiled), warnings))
        }
    }
}

fn turn_upright(mesh: &mut Mesh, up: Up) {
    if up == Up::Y {
        return;
    }
    mesh.positions.iter_mut().for_each(|position| *position = up.upright(*position));
    mesh.normals.iter_mut().for_each(|normal| *normal = up.upright(normal.as_dvec3()).as_vec3());
}

/// What a compiled model has no place for.
fn refuse_for_compiled(path: &Path, options: LoadOptions) -> Result<(), SceneError> {
    let refused = |message: &str| Err(SceneError::in_file(path, message));
    if options.crease_angle.is_some() {
        return refused("a compiled model has its normals: give --crease-angle to `rayfarm-master compile`");
    }
    if options.up.is_some() {
        return refused("a compiled model keeps its axes: give --up to the command that shows it");
    }
    Ok(())
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

fn load_scene_file(path: &Path, options: LoadOptions) -> Result<LoadedScene, SceneError> {
    refuse_for_scene(path, options)?;
    let content = bytes(path, MAX_SCENE_BYTES)?;
    let text = text_of(path, &content)?;
    let complain = |fault: file::Fault| {
        let (line, column) = file::place(text, fault.at);
        SceneError::InScene { path: path.to_owned(), line, column, message: fault.message }
    };
    let read = file::read(text).map_err(complain)?;
    let mut warnings: Vec<String> = read.warnings.iter().cloned().map(|w| complain(w).to_string()).collect();
    let mut models = Models::open(path, &read.models, &read.textures, options).map_err(complain)?;
    let mut loaded = assemble(path, read, &mut models, &complain)?;
    warnings.append(&mut models.warnings);
    loaded.warnings = warnings;
    Ok(loaded)
}

/// What each model of a scene file says by itself.
fn refuse_for_scene(path: &Path, options: LoadOptions) -> Result<(), SceneError> {
    let refused = |option: &str, key: &str| {
        let message =
            format!("{option} is for a model by itself: write {key} in [[model]] of the scene file");
        Err(SceneError::in_file(path, message))
    };
    if options.up.is_some() {
        return refused("--up", "`up = \"z\"`");
    }
    if options.crease_angle.is_some() {
        return refused("--crease-angle", "`crease_angle`");
    }
    Ok(())
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
    let size = (text.render.width, text.render.height);
    let mut scene = Scene {
        ambient: text.ambient,
        render: text.render,
        camera: framing::camera_showing(None, models.options.size.unwrap_or(size)),
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
    let (maps, textures, notes) = std::mem::take(&mut models.textures).into_parts();
    scene.textures = maps;
    models.warnings.extend(notes);
    let meshes = models.take_meshes();
    let file_of = |mesh: &Arc<CompiledMesh>| {
        let mut files = scene.models.iter().zip(&text.models);
        files.find(|(model, _)| model.mesh == mesh.id()).map(|(_, text)| PathBuf::from(&text.file))
    };
    let mesh_files = meshes.iter().map(|mesh| file_of(mesh).unwrap_or_default()).collect();
    let bounds = framing::bounds(&scene, &meshes);
    scene.camera = match text.camera {
        Some(camera) => aimed(camera, bounds),
        None if bounds.is_none() => {
            let message = "[camera] is missing, and nothing finite is there to be framed; add one with `position` and `look_at`";
            return Err(SceneError::in_file(path, message));
        }
        None => framing::camera_showing(bounds, models.options.size.unwrap_or(size)),
    };
    if scene.lights.is_empty() {
        scene.lights.push(framing::default_light(&scene.camera));
    }
    Ok(LoadedScene { scene, meshes, mesh_files, textures, warnings: Vec::new() })
}

/// Where a file is that the scene file names. Back slashes separate its parts where no file has them in its name.
fn named(folder: &Path, file: &Path) -> PathBuf {
    let path = folder.join(file);
    match file.to_str().filter(|name| name.contains('\\') && !path.exists()) {
        Some(name) => folder.join(name.replace('\\', "/")),
        None => path,
    }
}

/// Textures of the scene file's own materials, as far as something has them.
fn load_textures(
    folder: &Path,
    texts: &BTreeMap<u32, TexturesText>,
    scene: &mut Scene,
    textures: &mut Textures,
) -> Result<(), file::Fault> {
    let of_models = scene.models.iter().flat_map(|model| model.materials.iter().copied());
    let used: BTreeSet<u32> =
        of_models.chain(scene.triangles.iter().map(|triangle| triangle.material)).collect();
    let mut list = |text: &TextureText| {
        let listed = textures.add(&named(folder, &text.file), text.filter, text.tiling);
        listed.map_err(|reason| file::Fault {
            at: text.at,
            message: format!("the texture: {reason} (paths are relative to the scene file)"),
        })
    };
    for (index, text) in texts.iter().filter(|(index, _)| used.contains(index)) {
        let Some(material) = scene.materials.get_mut(*index as usize) else { continue };
        let texture = text.diffuse.as_ref().map(&mut list).transpose()?;
        material.texture = texture.map(|listed| listed.index);
        material.cutout = texture.filter(|listed| listed.cuts).map(|listed| listed.index);
        material.emission_texture =
            text.emission.as_ref().map(&mut list).transpose()?.map(|listed| listed.index);
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

/// Material slots of all instances: each instance has its own list of them.
const MAX_ALL_SLOTS: usize = if cfg!(test) { 2_000 } else { 1 << 22 };

/// The models of a scene file: each file is loaded and compiled once, however often and by whatever path it is named.
struct Models {
    /// The real path of each file that the scene names.
    paths: BTreeMap<PathBuf, PathBuf>,
    /// Where the names in the scene file begin.
    folder: PathBuf,
    options: LoadOptions,
    /// Real paths of the files that some instance shows smoothly.
    smooth: BTreeSet<PathBuf>,
    /// By real path: what the instances of a file need of its texture coordinates.
    uvs: BTreeMap<PathBuf, Uvs>,
    textures: Textures,
    /// By real path and crease angle.
    loaded: BTreeMap<(PathBuf, Option<u64>), LoadedModel>,
    /// Material slots of all instances so far.
    slots: usize,
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
        textures: &BTreeMap<u32, TexturesText>,
        options: LoadOptions,
    ) -> Result<Self, file::Fault> {
        let folder = scene.parent().unwrap_or(Path::new(""));
        let mut all = Self {
            paths: BTreeMap::new(),
            folder: folder.to_owned(),
            options,
            smooth: BTreeSet::new(),
            uvs: BTreeMap::new(),
            textures: Textures::default(),
            loaded: BTreeMap::new(),
            slots: 0,
            warnings: Vec::new(),
        };
        for model in models {
            let path = named(folder, &model.file);
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
            let wanted = match model.material.map(|material| textures.get(&material)) {
                None => Uvs::Textured,
                Some(Some(texts)) if texts.tell_repeats_apart() => Uvs::Whole,
                Some(Some(_)) => Uvs::Always,
                Some(None) => Uvs::Never,
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
        textures: &BTreeMap<u32, TexturesText>,
        complain: &impl Fn(file::Fault) -> SceneError,
    ) -> Result<Model, SceneError> {
        let real = self.paths.get(&text.file).unwrap_or(&text.file).clone();
        let crease_angle = text.crease_angle.map(|(degrees, _)| degrees);
        let loaded = match self.loaded.entry((real, crease_angle.map(f64::to_bits))) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                let (real, _) = entry.key();
                let normals = self.smooth.contains(real);
                let uvs = self.uvs.get(real).copied().unwrap_or(Uvs::Never);
                // Messages name the file as the user does.
                let path = named(&self.folder, &text.file);
                let compile = CompileOptions { normals, ..CompileOptions::default() };
                let crease_angle = match text.crease_angle {
                    Some((_, at)) if Kind::of(&path)? == Kind::Compiled => {
                        let message = "`crease_angle` in [[model]] has no effect: a compiled model has its normals; \
                                       give --crease-angle to `rayfarm-master compile`";
                        self.warnings.push(complain(file::Fault { at, message: message.into() }).to_string());
                        None
                    }
                    _ => crease_angle,
                };
                let options = LoadOptions { crease_angle, ..self.options };
                let (mesh, warnings) = load_model(&path, compile, uvs, options)?;
                self.warnings.extend(warnings);
                entry.insert(LoadedModel { path, mesh, own_materials: None })
            }
        };
        self.slots += loaded.mesh.material_count();
        if self.slots > MAX_ALL_SLOTS {
            return Err(complain(file::Fault {
                at: text.at,
                message: format!(
                    "the models up to here have {} materials in all, each counted once for each instance; \
                     at most {MAX_ALL_SLOTS} are allowed",
                    self.slots
                ),
            }));
        }
        let slots = match text.material {
            Some(material) if textures.contains_key(&material) && !loaded.mesh.has_uvs() => {
                return Err(complain(without_uvs(text)));
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
