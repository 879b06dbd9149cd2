//! Texture coordinates of an OBJ text: a reading of its own, behind the first, for the few models whose materials have
//! textures. They stay with the corners of the triangles, so that a seam in them splits no vertex: normals are averaged
//! over vertices.

use glam::{DVec2, Vec2};

use super::lines::{Line, lines};
use crate::texture::without_repeats;

/// The texture coordinates of every triangle, in the order of the faces, polygons fanned from their first corner. `None` for a
/// triangle with a corner that has none, or one that is not there, not a number, or beyond
/// [`crate::texture::MAX_UV`].
pub(super) fn read(text: &str) -> Vec<Option<[Vec2; 3]>> {
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for line in lines(text) {
        match line.keyword() {
            "vt" => points.push(point(&line)),
            "f" => fan(&line, points.len(), &mut triangles),
            _ => {}
        }
    }
    // Faces may come before what they name.
    let find = |index: u32| points.get((index as usize).wrapping_sub(1)).copied().unwrap_or(DVec2::NAN);
    triangles.into_iter().map(|corners: [u32; 3]| without_repeats(corners.map(find))).collect()
}

/// `vt u`, `vt u v` or `vt u v w`.
fn point(line: &Line<'_>) -> DVec2 {
    let mut numbers = line.rest().split_ascii_whitespace().map(|word| word.parse().unwrap_or(f64::NAN));
    DVec2::new(numbers.next().unwrap_or(f64::NAN), numbers.next().unwrap_or(0.0))
}

/// The triangles of a face as indices counted from 1; 0 where there is none.
fn fan(line: &Line<'_>, count: usize, triangles: &mut Vec<[u32; 3]>) {
    let mut corners = line.rest().split_ascii_whitespace().map(|corner| index(corner, count));
    let (Some(first), Some(mut last)) = (corners.next(), corners.next()) else { return };
    for next in corners {
        triangles.push([first, last, next]);
        last = next;
    }
}

/// The middle part of `v/vt/vn`; a negative one counts back from the line.
fn index(corner: &str, count: usize) -> u32 {
    let index: i64 = corner.split('/').nth(1).and_then(|part| part.parse().ok()).unwrap_or(0);
    let index = if index < 0 { (count as i64).saturating_add(index).saturating_add(1) } else { index };
    u32::try_from(index).unwrap_or(0)
}
