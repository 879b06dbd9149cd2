//! Cleaning and centring of a mesh before its tree is built.
//!
//! Tree builders and intersection tests do not accept every input: not vertices that are not finite, triangles
//! without an area, and thousands of copies of one triangle (no split separates them, so the tree degenerates to a
//! list). These are dropped and counted. The remaining mesh is moved to its own centre and scaled by a power of two,
//! so that coordinates are within [-1, 1] and `f32` has its digits for the shape, whatever the model's position and
//! size. Both steps are exact up to one rounding to `f32` per coordinate.

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::{MAX_COORDINATE, MAX_MATERIALS, MAX_TRIANGLES, Mesh, MeshError, MeshReport, Smoothing, normals};

/// A cleaned and centred mesh.
pub(super) struct CleanMesh {
    /// Corners in mesh space, within [-1, 1].
    pub corners: Vec<[Vec3; 3]>,
    /// Corners as indices into `normals`; into the source's positions where `normals` is empty.
    pub indices: Vec<[u32; 3]>,
    /// Position of each kept triangle in the source.
    pub sources: Vec<u32>,
    /// Material slot of each kept triangle.
    pub slots: Vec<u16>,
    /// Texture coordinates of each kept triangle; empty where the source has none.
    pub uvs: Vec<[Vec2; 3]>,
    /// Whole repeats of each kept triangle; empty where the source has none.
    pub uv_repeats: Vec<Vec2>,
    /// Colours of each kept triangle; empty where the source has none.
    pub colors: Vec<[[u8; 3]; 3]>,
    /// Unit normals; empty if not requested, and where all triangles are flat.
    pub normals: Vec<Vec3>,
    /// Centre in model space: model = center + mesh * 2^exponent.
    pub center: DVec3,
    /// Binary exponent of the scale: see `center`.
    pub exponent: i32,
    /// Bounds of the kept triangles in model space.
    pub bounds: (DVec3, DVec3),
}

pub(super) fn clean(mesh: &Mesh, with_normals: bool) -> Result<(CleanMesh, MeshReport), MeshError> {
    check_shape(mesh)?;
    let mut report = MeshReport::default();
    let finite: Vec<u32> = (0..mesh.triangles.len() as u32)
        .filter(|&i| mesh.triangles[i as usize].iter().all(|&v| is_usable(mesh.positions[v as usize])))
        .collect();
    report.dropped_not_finite = mesh.triangles.len() - finite.len();

    let bounds = bounds_of(mesh, &finite);
    let (center, exponent) = placement(bounds);
    let unscale = libm::exp2(-f64::from(exponent));
    let to_mesh = |v: u32| ((mesh.positions[v as usize] - center) * unscale).as_vec3();

    let mut kept = CleanMesh {
        corners: Vec::with_capacity(finite.len()),
        indices: Vec::with_capacity(finite.len()),
        sources: Vec::with_capacity(finite.len()),
        slots: Vec::with_capacity(finite.len()),
        uvs: Vec::with_capacity(if mesh.uvs.is_empty() { 0 } else { finite.len() }),
        uv_repeats: Vec::new(),
        colors: Vec::new(),
        normals: Vec::new(),
        center,
        exponent,
        bounds,
    };
    let all: Vec<[Vec3; 3]> =
        finite.par_iter().map(|&source| mesh.triangles[source as usize].map(to_mesh)).collect();
    let repeated = repeated(&all, |first, copy| sides_differ(mesh, &all, &finite, first, copy));
    for ((source, corners), is_repeated) in finite.into_iter().zip(all).zip(repeated) {
        let indices = mesh.triangles[source as usize];
        if is_degenerate(&corners) {
            report.dropped_degenerate += 1;
        } else if is_repeated {
            report.dropped_duplicate += 1;
        } else {
            kept.corners.push(corners);
            kept.indices.push(indices);
            kept.sources.push(source);
            kept.slots.push(mesh.triangle_materials[source as usize]);
            kept.uvs.extend(mesh.uvs.get(source as usize));
            kept.uv_repeats.extend(mesh.uv_repeats.get(source as usize));
            kept.colors.extend(mesh.colors.get(source as usize));
        }
    }
    if kept.corners.is_empty() {
        return Err(MeshError::Empty { dropped: report.dropped() });
    }
    if with_normals {
        normals::fill_in(mesh, &mut kept);
    }
    Ok((kept, report))
}

/// Checks the lengths and indices on which the other steps rely.
fn check_shape(mesh: &Mesh) -> Result<(), MeshError> {
    let triangles = mesh.triangles.len();
    if triangles > MAX_TRIANGLES {
        return Err(MeshError::TooMany { what: "triangles", count: triangles, limit: MAX_TRIANGLES });
    }
    if mesh.materials.len() > MAX_MATERIALS {
        return Err(MeshError::TooMany {
            what: "materials",
            count: mesh.materials.len(),
            limit: MAX_MATERIALS,
        });
    }
    if mesh.triangle_materials.len() != triangles {
        return Err(MeshError::Inconsistent(format!(
            "{triangles} triangles but {} material slots for them",
            mesh.triangle_materials.len()
        )));
    }
    for (what, count) in [
        ("texture coordinates", mesh.uvs.len()),
        ("whole repeats of texture coordinates", mesh.uv_repeats.len()),
        ("colours of vertices", mesh.colors.len()),
    ] {
        if count != 0 && count != triangles {
            return Err(MeshError::Inconsistent(format!("{triangles} triangles but {what} for {count}")));
        }
    }
    if !mesh.normals.is_empty() && mesh.normals.len() != mesh.positions.len() {
        return Err(MeshError::Inconsistent(format!(
            "{} positions but {} normals",
            mesh.positions.len(),
            mesh.normals.len()
        )));
    }
    if let Smoothing::Groups(groups) = &mesh.smoothing
        && groups.len() != triangles
    {
        return Err(MeshError::Inconsistent(format!(
            "{triangles} triangles but smoothing groups for {}",
            groups.len()
        )));
    }
    if let Some(index) = mesh.triangles.iter().flatten().find(|&&v| v as usize >= mesh.positions.len()) {
        return Err(MeshError::Inconsistent(format!(
            "a triangle names vertex {index}, but there are {} (counted from 0)",
            mesh.positions.len()
        )));
    }
    if let Some(slot) = mesh.triangle_materials.iter().find(|&&slot| slot as usize >= mesh.materials.len()) {
        return Err(MeshError::Inconsistent(format!(
            "a triangle names material slot {slot}, but there are {}",
            mesh.materials.len()
        )));
    }
    Ok(())
}

fn is_usable(position: DVec3) -> bool {
    position.is_finite() && position.abs().max_element() <= MAX_COORDINATE
}

fn bounds_of(mesh: &Mesh, triangles: &[u32]) -> (DVec3, DVec3) {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    triangles.iter().flat_map(|&i| mesh.triangles[i as usize]).fold(empty, |(lo, hi), v| {
        let position = mesh.positions[v as usize];
        (lo.min(position), hi.max(position))
    })
}

/// Centre, and the exponent of the power of two that scales the half extent into (1/2, 1].
fn placement((lo, hi): (DVec3, DVec3)) -> (DVec3, i32) {
    if !lo.is_finite() || !hi.is_finite() {
        return (DVec3::ZERO, 0);
    }
    let center = lo * 0.5 + hi * 0.5;
    let half_extent = (hi - center).max(center - lo).max_element();
    let (_, exponent) = libm::frexp(half_extent);
    (center, if half_extent > 0.0 { exponent } else { 0 })
}

/// Whether a triangle has no area in exact arithmetic: products of `f32` differences are exact in `f64`, up to the
/// final subtraction.
fn is_degenerate(corners: &[Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a) == DVec3::ZERO
}

/// Flags the copies of earlier triangles, except those that are needed as the other side of a face: `differ` decides
/// for two triangles of opposite winding whether they look different.
///
/// Sorted by a hash, copies are adjacent; among triangles with the same hash the corners decide. So the time is O(n
/// log n) for all triangles.
fn repeated(triangles: &[[Vec3; 3]], differ: impl Fn(usize, usize) -> bool) -> Vec<bool> {
    let mut by_hash: Vec<(u64, u32)> =
        (0_u32..).zip(triangles).map(|(i, corners)| (hash(&identity(corners)), i)).collect();
    by_hash.par_sort_unstable();
    let mut repeated = vec![false; triangles.len()];
    for alike in by_hash.chunk_by(|a, b| a.0 == b.0).filter(|alike| alike.len() > 1) {
        let mut alike: Vec<_> = alike.iter().map(|&(_, i)| (identity(&triangles[i as usize]), i)).collect();
        alike.sort_unstable();
        for duplicates in alike.chunk_by(|a, b| a.0 == b.0) {
            let mut duplicates = duplicates.iter().map(|&(_, i)| i as usize);
            let Some(first) = duplicates.next() else { continue };
            let mut has_other_side = false;
            for copy in duplicates {
                let is_other_side = is_turned(&triangles[first], &triangles[copy]);
                let needed = is_other_side && !has_other_side && differ(first, copy);
                has_other_side |= needed;
                repeated[copy] = !needed;
            }
        }
    }
    repeated
}

/// Index of each corner of one triangle among those of another with the same corners.
fn matching(a: &[Vec3; 3], b: &[Vec3; 3]) -> [usize; 3] {
    a.map(|corner| b.iter().position(|&other| other == corner).unwrap_or(0))
}

/// Whether two triangles with the same corners have opposite windings.
fn is_turned(a: &[Vec3; 3], b: &[Vec3; 3]) -> bool {
    let [first, second, _] = matching(a, b);
    second != (first + 1) % 3
}

/// Whether two triangles with the same corners, as two sides of one face, look different: by material, texture
/// coordinates, or normals.
fn sides_differ(mesh: &Mesh, corners: &[[Vec3; 3]], sources: &[u32], a: usize, b: usize) -> bool {
    let places = matching(&corners[a], &corners[b]);
    let [a, b] = [a, b].map(|i| sources[i] as usize);
    let normal = |triangle: usize, corner: usize| mesh.normals[mesh.triangles[triangle][corner] as usize];
    let other_normal = |corner: usize| {
        let (own, others) = (normal(a, corner), normal(b, places[corner]));
        own != others && own != -others
    };
    mesh.triangle_materials[a] != mesh.triangle_materials[b]
        || !mesh.uvs.is_empty() && (0..3).any(|k| mesh.uvs[a][k] != mesh.uvs[b][places[k]])
        || !mesh.colors.is_empty() && (0..3).any(|k| mesh.colors[a][k] != mesh.colors[b][places[k]])
        || !mesh.normals.is_empty() && (0..3).any(other_normal)
}

/// A hash: multiplies and folds number by number.
fn hash(identity: &[[u32; 3]; 3]) -> u64 {
    identity.iter().flatten().fold(1 << 63, |hash: u64, &bits| {
        let product = u128::from(hash ^ u64::from(bits)) * 0x9E37_79B9_7F4A_7C15;
        (product as u64) ^ (product >> 64) as u64
    })
}

/// The corners in a canonical order: equal for triangles with the same corners in the same or the opposite winding.
fn identity(corners: &[Vec3; 3]) -> [[u32; 3]; 3] {
    // Adding zero turns -0.0 into 0.0.
    let mut bits = corners.map(|corner| (corner + Vec3::ZERO).to_array().map(f32::to_bits));
    bits.sort_unstable();
    bits
}
