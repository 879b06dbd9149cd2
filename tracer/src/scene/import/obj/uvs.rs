//! Texture coordinates of the triangles of an OBJ text. They stay with the corners, so that a seam in them splits no vertex:
//! normals are averaged over vertices.

use glam::{DVec2, Vec2};

use super::geometry::Geometry;
use crate::texture::apart_from_repeats;

/// Texture coordinates of a triangle, and the whole repeats that were taken off; `None` where it has none.
pub(super) type TriangleUvs = Option<([Vec2; 3], Vec2)>;

/// The texture coordinates of every triangle, whole repeats apart, in their order. `None` for a triangle with a corner that
/// has none, or one that is not there, not a number, or beyond [`crate::texture::MAX_UV`].
pub(super) fn of_triangles(geometry: &Geometry) -> Vec<TriangleUvs> {
    let uv = |corner: u32| geometry.uvs.get(geometry.corners[corner as usize].uv as usize).copied();
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| uv(corner).unwrap_or(DVec2::NAN));
    geometry.triangles.iter().map(|triangle| apart_from_repeats(corners(triangle))).collect()
}
