//! Loading of single models: as scenes of their own, as parts of a scene, and to be compiled into files.

use std::path::Path;
use std::sync::Arc;

use super::LoadedScene;
use super::framing;
use super::limits::LoadLimits;
use super::loader::{Caches, ModelKey};
use super::moved;
use super::textures::Textures;
use crate::files::FileStamp;
use crate::mesh::{CompileOptions, CompiledMesh, Mesh, MeshReport};
use crate::scene::import::{Kind, LoadOptions, MAX_MODEL_BYTES, SceneError, Up, Uvs, bytes, load_obj};

/// Loads and compiles a model, or takes a compiled one as it is, to be kept in a file in `folder`: with everything that a
/// scene may need of it, and with the picture files of its materials named relative to that folder. Returns the mesh and
/// warnings.
///
/// # Errors
/// As [`load`](fn@super::load).
pub fn compile_model(
    path: &Path,
    folder: &Path,
    compile: CompileOptions,
) -> Result<(Arc<CompiledMesh>, Vec<String>), SceneError> {
    compile_model_with(path, folder, compile, LoadOptions::default())
}

/// [`compile_model`] with options.
///
/// # Errors
/// As [`load`](fn@super::load).
pub fn compile_model_with(
    path: &Path,
    folder: &Path,
    compile: CompileOptions,
    options: LoadOptions,
) -> Result<(Arc<CompiledMesh>, Vec<String>), SceneError> {
    let (mesh, mut warnings) = load_model(path, compile, Uvs::Whole, options, &mut Vec::new())?;
    let from = path.parent().unwrap_or(Path::new(""));
    let moved = moved::texture_names(&mesh, from, folder)
        .map_err(|source| SceneError::Mesh { path: path.to_owned(), source })?;
    let mesh = moved.map_or(mesh, Arc::new);
    if moved::leads_out(&mesh) {
        warnings.push(format!(
            "{}: the pictures of its materials are outside of the folder of the compiled model, which shows them with \
             --allow-parent-textures only; compile it into the folder of the model",
            path.display()
        ));
    }
    Ok((mesh, warnings))
}

/// Loads a model as a scene of its own, with a default camera, light and background.
pub(super) fn load_bare(
    path: &Path,
    options: LoadOptions,
    limits: LoadLimits,
    caches: &Caches,
) -> Result<LoadedScene, SceneError> {
    // The instance is rotated upright in place of the mesh: compiled meshes cannot be changed.
    let unturned = LoadOptions { up: None, ..options };
    let compile = CompileOptions::default();
    let real = path.canonicalize().map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
    let key = ModelKey {
        path: real,
        crease_angle: options.crease_angle.map(f64::to_bits),
        normals: compile.normals,
        uvs: Uvs::Textured,
    };
    let load = |files: &mut Vec<FileStamp>| load_model(path, compile, Uvs::Textured, unturned, files);
    let (mesh, mut warnings) = caches.models.get_or_read(key, load)?;
    let mut scene = framing::bare_model(&mesh, options.up.unwrap_or_default(), options.size);
    let mut textures = Textures::with_cache(limits.texture_bytes, &caches.pictures);
    scene.materials = textures.of_model(path, &mesh, options.allow_parent_textures, &mut warnings);
    let (maps, textures, notes) = textures.take_parts();
    scene.textures = maps;
    warnings.extend(notes);
    let mesh_files = vec![path.to_owned()];
    Ok(LoadedScene { scene, meshes: vec![mesh], mesh_files, textures, warnings, animation: None })
}

/// Loads and compiles a model, or reads a compiled one. Returns the mesh and warnings, and adds the files that it reads, with
/// their state before that.
pub(super) fn load_model(
    path: &Path,
    compile: CompileOptions,
    uvs: Uvs,
    options: LoadOptions,
    files: &mut Vec<FileStamp>,
) -> Result<(Arc<CompiledMesh>, Vec<String>), SceneError> {
    files.push(FileStamp::of(path));
    let failed = |source| SceneError::Mesh { path: path.to_owned(), source };
    match Kind::of(path)? {
        Kind::Scene => Err(SceneError::in_file(path, "a scene file, where a model was expected")),
        Kind::Compiled => {
            refuse_for_compiled(path, options)?;
            let mesh = CompiledMesh::from_bytes(&bytes(path, MAX_MODEL_BYTES)?).map_err(failed)?;
            Ok((Arc::new(mesh), Vec::new()))
        }
        Kind::Obj => {
            let (mut mesh, mut warnings) = load_obj(path, uvs, options, files)?;
            turn_upright(&mut mesh, options.up.unwrap_or_default());
            let (compiled, report) = CompiledMesh::compile_with(&mesh, compile).map_err(failed)?;
            warnings.extend(describe(path, report));
            Ok((Arc::new(compiled), warnings))
        }
    }
}

/// Rotates a mesh so that its up axis is Y.
fn turn_upright(mesh: &mut Mesh, up: Up) {
    if up == Up::Y {
        return;
    }
    mesh.positions.iter_mut().for_each(|position| *position = up.upright(*position));
    mesh.normals.iter_mut().for_each(|normal| *normal = up.upright(normal.as_dvec3()).as_vec3());
}

/// Refuses options that a compiled model cannot follow.
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

/// A warning about dropped triangles, if there are any.
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
