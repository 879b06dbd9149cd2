//! Import of Wavefront OBJ with its material libraries.
//!
//! One pass checks every line and collects the geometry ([`geometry`]), with polygons triangulated ([`polygon`]);
//! corners become vertices ([`vertices`]), and materials become slots in the order of the triangles ([`slots`]).

mod colors;
mod corner;
mod faceless;
mod geometry;
mod libraries;
mod lines;
mod materials;
mod numbers;
mod picture;
mod polygon;
mod slots;
mod tiling;
mod uvs;
mod vertices;

#[cfg(test)]
mod tests;

use std::path::Path;

use glam::{Vec2, Vec3};

use super::foreign::is_binary;
use super::read::{MAX_MODEL_BYTES, bytes};
use super::text::decoded;
use super::warnings::Warnings;
use super::{DEFAULT_CREASE_ANGLE, LoadOptions, SceneError};
use crate::files::FileStamp;
use crate::material::Material;
use crate::mesh::{Mesh, NamedMaterial};
use geometry::{Geometry, MaterialRun};
use materials::Library;
use slots::{assign_materials, find};
use uvs::TriangleUvs;

/// Choice of the texture coordinates that a mesh takes from its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::scene) enum Uvs {
    /// None: no material has a texture.
    Never,
    /// Those of triangles whose own material has a texture.
    Textured,
    /// All: a material of the scene with a texture may be assigned.
    Always,
    /// All, with whole repeats for textures that distinguish them.
    Whole,
}

/// [`load_noting`] without the files.
#[cfg(test)]
fn load(path: &Path, wanted: Uvs, options: LoadOptions) -> Result<(Mesh, Vec<String>), SceneError> {
    load_noting(path, wanted, options, &mut Vec::new())
}

/// Reads a model. Returns the mesh and warnings about ignored parts, and adds the material libraries that it reads or misses,
/// with their state before that. In a file with neither normals nor smoothing
/// groups, faces that meet at the crease angle at most are smooth.
///
/// # Errors
/// A file that cannot be read, an invalid line, an index out of range, a used vertex that is not finite, a file
/// without faces.
pub(in crate::scene) fn load_noting(
    path: &Path,
    wanted: Uvs,
    options: LoadOptions,
    files: &mut Vec<FileStamp>,
) -> Result<(Mesh, Vec<String>), SceneError> {
    let content = bytes(path, MAX_MODEL_BYTES)?;
    let mut warnings = Warnings::about(path);
    let text = decoded(&content);
    let failed = |fault: geometry::LineError| {
        // The expected form of a line is no help where the file is not text.
        if is_binary(&content, &text) {
            return SceneError::in_file(path, faceless::reason(&content, &text));
        }
        SceneError::InModel { path: path.to_owned(), line: fault.line, message: fault.message }
    };
    let crease_angle = options.crease_angle.unwrap_or(DEFAULT_CREASE_ANGLE);
    let geometry = geometry::read(&text, crease_angle, &mut warnings).map_err(failed)?;
    if geometry.triangles.is_empty() {
        return Err(SceneError::in_file(path, faceless::reason(&content, &text)));
    }
    drop(text);
    drop(content);
    let (library, messages) =
        libraries::read(path, &geometry.libraries, &geometry.runs, options, &mut warnings, files);
    let uvs = wanted_uvs(wanted, &geometry, &library, &mut warnings);
    let mut mesh = vertices::mesh(&geometry);
    mesh.colors = colors::of_model(&geometry);
    // Vertex colours are factors of the diffuse colour, so the neutral material is white with them.
    let diffuse = if mesh.colors.is_empty() { Material::NEUTRAL.diffuse } else { Vec3::ONE };
    let neutral = NamedMaterial::plain("neutral", Material { diffuse, ..Material::NEUTRAL });
    assign_materials(path, &mut mesh, &geometry.runs, &library, &neutral, uvs.as_deref())?;
    let uvs = uvs.into_iter().flatten().map(Option::unwrap_or_default);
    (mesh.uvs, mesh.uv_repeats) = uvs.unzip();
    let textures = || mesh.materials.iter().flat_map(NamedMaterial::textures);
    let told_apart = wanted == Uvs::Whole || textures().any(|texture| texture.tiling.distinguishes_repeats());
    if !told_apart || mesh.uv_repeats.iter().all(|repeats| *repeats == Vec2::ZERO) {
        mesh.uv_repeats = Vec::new();
    }
    let mut all = warnings.into_messages();
    all.extend(messages);
    Ok((mesh, all))
}

/// Texture coordinates of each triangle, if requested and present.
fn wanted_uvs(
    wanted: Uvs,
    geometry: &Geometry,
    library: &Library,
    warnings: &mut Warnings,
) -> Option<Vec<TriangleUvs>> {
    let has_texture = |run: &MaterialRun| {
        let material = run.material.as_deref().and_then(|name| find(library, name));
        run.triangles > 0 && material.is_some_and(|material| material.textures().next().is_some())
    };
    let textured = wanted != Uvs::Never && geometry.runs.iter().any(has_texture);
    if !textured && wanted < Uvs::Always {
        return None;
    }
    let uvs = uvs::of_triangles(geometry);
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
