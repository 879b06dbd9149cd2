//! Wavefront OBJ with its material libraries: a text in, a [`Mesh`] out.
//!
//! A first reading checks every line and keeps what is geometry ([`geometry`]); `tobj` cuts polygons into triangles
//! and pairs positions with normals; materials are put back by the order of the triangles.

mod geometry;
mod lines;
mod materials;
mod picture;
mod slots;
mod uvs;

#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::panic::catch_unwind;
use std::path::Path;

use glam::{DVec3, Vec2, Vec3};

use super::SceneError;
use super::read::{MAX_MODEL_BYTES, bytes};
use super::warnings::Warnings;
use crate::mesh::Mesh;
use geometry::{Geometry, MaterialRun};
use materials::Library;
use slots::{assign_materials, find};

/// When a mesh is to carry the texture coordinates that its file gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Uvs {
    /// No texture is laid on it.
    Never,
    /// Where a material of its own has a texture.
    Textured,
    /// Whenever there are any: somebody else's texture may be laid on it.
    Always,
}

/// Reads a model. With it come warnings about what was left out.
///
/// # Errors
/// A file that cannot be read, a line that is no OBJ, an index that points nowhere, a used vertex that is not finite,
/// a file without faces.
pub(super) fn load(path: &Path, wanted: Uvs) -> Result<(Mesh, Vec<String>), SceneError> {
    let content = bytes(path, MAX_MODEL_BYTES)?;
    let mut warnings = Warnings::about(path);
    let geometry = read_geometry(path, &content, &mut warnings)?;
    let triangles: usize = geometry.runs.iter().map(|run| run.triangles).sum();
    if triangles == 0 {
        return Err(SceneError::in_file(path, "no faces in the file; a model needs at least one `f` line"));
    }
    let (library, messages) = read_libraries(path, &geometry, &mut warnings);
    let uvs = read_uvs(&content, wanted, &geometry, &library, &mut warnings);
    drop(content);
    let mut mesh = parse(path, &geometry.text, triangles, &mut warnings)?;
    assign_materials(path, &mut mesh, &geometry.runs, &library, uvs.as_deref())?;
    mesh.uvs = uvs.into_iter().flatten().map(Option::unwrap_or_default).collect();
    let mut all = warnings.into_messages();
    all.extend(messages);
    Ok((mesh, all))
}

/// Comments in old files are in old encodings: what is no UTF-8 is replaced.
fn read_geometry(path: &Path, content: &[u8], warnings: &mut Warnings) -> Result<Geometry, SceneError> {
    let text: Cow<'_, str> = String::from_utf8_lossy(content);
    let text = text.trim_start_matches('\u{feff}');
    let failed = |e: geometry::LineError| SceneError::InModel {
        path: path.to_owned(),
        line: e.line,
        message: e.message,
    };
    let geometry = geometry::read(text, true, warnings).map_err(failed)?;
    if !geometry.uneven_normals {
        return Ok(geometry);
    }
    warnings.at_file("some corners have a normal and some have none: normals are averaged instead");
    // What is odd has been told the first time.
    geometry::read(text, false, &mut Warnings::about(path)).map_err(failed)
}

/// All libraries that the file names. Where one is missing, unknown materials need no warnings of their own.
fn read_libraries(path: &Path, geometry: &Geometry, warnings: &mut Warnings) -> (Library, Vec<String>) {
    let mut library = Library::new();
    let mut messages = Vec::new();
    let mut complete = true;
    for (line, names) in &geometry.libraries {
        let (whole, more) = materials::load(path, names, *line, &mut library, warnings);
        complete &= whole;
        messages.extend(more);
    }
    if complete {
        warn_of_unknown(&geometry.runs, &library, warnings);
    }
    (library, messages)
}

fn warn_of_unknown(runs: &[MaterialRun], library: &Library, warnings: &mut Warnings) {
    let mut unknown: BTreeMap<&str, usize> = BTreeMap::new();
    for run in runs {
        if let Some(name) = run.material.as_deref().filter(|name| find(library, name).is_none()) {
            unknown.entry(name).or_insert(run.line);
        }
    }
    for (name, line) in unknown {
        let name: String = name.chars().take(60).collect();
        let message = format!("no material library defines `{name}`: drawn with the neutral material");
        warnings.at_line(line, message);
    }
}

/// Texture coordinates of each triangle, where they are wanted and there are any.
fn read_uvs(
    content: &[u8],
    wanted: Uvs,
    geometry: &Geometry,
    library: &Library,
    warnings: &mut Warnings,
) -> Option<Vec<Option<[Vec2; 3]>>> {
    let has_texture = |run: &MaterialRun| {
        let material = run.material.as_deref().and_then(|name| find(library, name));
        run.triangles > 0 && material.is_some_and(|material| material.texture.is_some())
    };
    let textured = wanted != Uvs::Never && geometry.runs.iter().any(has_texture);
    if !textured && wanted != Uvs::Always {
        return None;
    }
    let uvs = uvs::read(&String::from_utf8_lossy(content));
    let missing = uvs.iter().filter(|uvs| uvs.is_none()).count();
    if missing == uvs.len() {
        if textured {
            warnings.at_file("its materials have textures, but no face has texture coordinates (`vt`): drawn with `Kd` alone");
        }
        return None;
    }
    if missing > 0 {
        warnings.at_file(format!(
            "triangles without texture coordinates that are finite and at most 1e6: {missing}; \
             they are drawn with `Kd` alone, or with the texel at (0, 0) where the scene gives the texture"
        ));
    }
    Some(uvs)
}

fn parse(path: &Path, text: &str, triangles: usize, warnings: &mut Warnings) -> Result<Mesh, SceneError> {
    let options =
        tobj::LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };
    // Every line has been checked, but what other people's code makes of them must not end the program.
    let parsed = catch_unwind(|| {
        tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Err(tobj::LoadError::OpenFileFailed))
    });
    let refused = |reason: String| SceneError::in_file(path, format!("the model cannot be read: {reason}"));
    let (mut models, _) = parsed
        .map_err(|_| refused("the parser gave up".into()))?
        .map_err(|reason| refused(reason.to_string()))?;
    let parsed = models.pop().ok_or_else(|| refused("no geometry".into()))?.mesh;
    if !models.is_empty() || parsed.indices.len() != 3 * triangles {
        return Err(refused(format!("{} corners for {triangles} triangles", parsed.indices.len())));
    }
    let positions: Vec<DVec3> = points(&parsed.positions).collect();
    let mut normals: Vec<Vec3> =
        points(&parsed.normals).map(|normal| normal.normalize_or_zero().as_vec3()).collect();
    if !normals.is_empty() && normals.len() != positions.len() {
        warnings.at_file("normals do not fit the vertices: they are averaged instead");
        normals.clear();
    }
    let triangles = parsed.indices.chunks_exact(3).filter_map(|corner| corner.try_into().ok()).collect();
    let mesh = Mesh { positions, normals, triangles, ..Mesh::default() };
    Ok(if mesh.normals.is_empty() { welded(mesh) } else { mesh })
}

/// Makes vertices at one place one vertex. Patches and parts repeat the vertices of their seams, and without normals
/// of the file's own the averaged ones must not see those seams.
fn welded(mesh: Mesh) -> Mesh {
    let mut positions: Vec<DVec3> = Vec::with_capacity(mesh.positions.len());
    let mut places: HashMap<[u64; 3], u32> = HashMap::with_capacity(mesh.positions.len());
    let mut weld = |position: &DVec3| {
        // Adding zero makes one zero of both.
        let place = position.to_array().map(|coordinate| (coordinate + 0.0).to_bits());
        *places.entry(place).or_insert_with(|| {
            positions.push(*position);
            (positions.len() - 1) as u32
        })
    };
    let vertices: Vec<u32> = mesh.positions.iter().map(&mut weld).collect();
    // Indices come from the parser, which counted them itself; one astray is left for the compiler to refuse.
    let weld_corner = |corner: u32| vertices.get(corner as usize).copied().unwrap_or(u32::MAX);
    let triangles = mesh.triangles.into_iter().map(|triangle| triangle.map(weld_corner)).collect();
    Mesh { positions, triangles, ..mesh }
}

fn points(numbers: &[f64]) -> impl Iterator<Item = DVec3> {
    numbers.chunks_exact(3).map(DVec3::from_slice)
}
