//! Texture coordinates of the triangles of an OBJ text. They belong to corners, so that a seam in them splits no
//! vertex: normals are averaged over vertices.

use glam::{DVec2, Vec2};

use super::geometry::Geometry;
use crate::texture::split_repeats;

/// Texture coordinates of a triangle, and the whole repeats that were removed; `None` where it has none.
pub(super) type TriangleUvs = Option<([Vec2; 3], Vec2)>;

/// The texture coordinates of every triangle, without whole repeats. `None` for a triangle with a corner without
/// texture coordinates, or with some that are missing in the file, no number, or beyond [`crate::texture::MAX_UV`].
pub(super) fn of_triangles(geometry: &Geometry) -> Vec<TriangleUvs> {
    let uv = |corner: u32| geometry.uvs.get(geometry.corners[corner as usize].uv as usize).copied();
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| uv(corner).unwrap_or(DVec2::NAN));
    geometry.triangles.iter().map(|triangle| split_repeats(corners(triangle))).collect()
}
