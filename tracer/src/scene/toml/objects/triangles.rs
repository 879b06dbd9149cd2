//! The tables `[[triangle]]`, and `[[rectangle]]` and `[[box]]`, which become triangles.

use glam::{DVec3, Vec2};

use super::super::Reading;
use super::super::fault::Read;
use super::super::material::Materials;
use super::super::table::Table;
use super::super::value::Value;
use crate::rotation;
use crate::scene::data::Triangle;
use crate::texture::without_repeats;

pub(in crate::scene::toml) const TRIANGLE_KEYS: &[&str] = &["name", "vertices", "uvs", "material"];
pub(in crate::scene::toml) const RECTANGLE_KEYS: &[&str] = &["name", "axis", "at", "ranges", "material"];
pub(in crate::scene::toml) const BOX_KEYS: &[&str] = &["name", "min", "max", "rotate", "material"];

/// Reads a triangle; none for one without an area, which is invisible.
pub(in crate::scene::toml) fn triangle(
    table: Table<'_>,
    materials: &mut Materials,
    reading: &mut Reading,
) -> Read<Vec<Triangle>> {
    let value = table.required("vertices")?;
    let vertices = value.three_points()?;
    let uvs = table.read("uvs", |value| value.three_uvs())?;
    let material = match uvs {
        Some(_) => materials.referred_or_neutral(table)?,
        None => materials.referred_plain(table, "add `uvs`, or use a material with a colour")?,
    };
    // Checked above: a triangle that needs coordinates has them.
    let uvs = uvs.filter(|_| materials.needs_uvs(material)).map(|uvs| {
        let near = without_repeats(uvs).filter(|_| !materials.distinguishes_repeats(material));
        near.unwrap_or(uvs.map(|uv| uv.as_vec2()))
    });
    let [a, b, c] = vertices;
    if a == b || b == c || c == a {
        reading.warn(value.start(), format!("{value} has no area: the triangle is left out"));
        return Ok(Vec::new());
    }
    Ok(vec![Triangle { vertices, uvs, material }])
}

/// A direction along an axis, towards its positive or its negative side.
#[derive(Clone, Copy)]
enum Side {
    Positive,
    Negative,
}

/// Reads a rectangle across an axis. Its front is on the axis' positive side.
pub(in crate::scene::toml) fn rectangle(table: Table<'_>, materials: &mut Materials) -> Read<Vec<Triangle>> {
    let axis = table.required("axis")?.word(&[("x", 0), ("y", 1), ("z", 2)])?;
    let at = table.required("at")?.coordinate()?;
    let ranges = table.required("ranges")?;
    let [first, second] = ranges.array("an array of two ranges, each of two numbers")?;
    let (first, second) = (range(first)?, range(second)?);
    let material = materials.referred_or_neutral(table)?;
    // The ranges are those of the other axes in alphabetical order.
    let corner = |end: usize| match axis {
        0 => DVec3::new(at, first[end], second[end]),
        1 => DVec3::new(first[end], at, second[end]),
        _ => DVec3::new(first[end], second[end], at),
    };
    let ends = [corner(0), corner(1)];
    let place = |corner: DVec3| corner;
    Ok(face(ends, axis, Side::Positive, place, material, materials.needs_uvs(material)).to_vec())
}

/// A range of coordinates, the smaller number first.
fn range(value: Value<'_>) -> Read<[f64; 2]> {
    let expected = "made of ranges of two numbers, the smaller one first";
    let [lower, upper] = value.array(expected)?;
    let range = [lower.coordinate()?, upper.coordinate()?];
    if range[0] < range[1] { Ok(range) } else { Err(value.must_be(expected)) }
}

/// Reads a box as twelve triangles, with their fronts outside. It is closed: faces have corners in common to the bit.
pub(in crate::scene::toml) fn cuboid(table: Table<'_>, materials: &mut Materials) -> Read<Vec<Triangle>> {
    let lower = table.required("min")?.vector()?;
    let upper_value = table.required("max")?;
    let upper = upper_value.vector()?;
    if !lower.cmplt(upper).all() {
        return Err(upper_value.must_be("above `min` along each axis"));
    }
    let degrees = table.read("rotate", |value| value.vector())?.unwrap_or(DVec3::ZERO);
    let material = materials.referred_or_neutral(table)?;
    let with_uvs = materials.needs_uvs(material);
    let (turn, center) = (rotation::of_model(degrees), lower * 0.5 + upper * 0.5);
    let place = |corner: DVec3| {
        // Without a rotation the corners keep all digits.
        if degrees == DVec3::ZERO { corner } else { center + turn * (corner - center) }
    };
    let sides = (0..3).flat_map(|axis| [(axis, Side::Negative), (axis, Side::Positive)]);
    let faces = sides.flat_map(|(axis, side)| face([lower, upper], axis, side, place, material, with_uvs));
    Ok(faces.collect())
}

/// The two triangles of a side of a box between two corners; the box may be flat along the axis. Seen from the front, u
/// runs to the right and v upwards from 0 to 1. Up is +y; on the upper side it is -z, on the lower side +z.
fn face(
    [lower, upper]: [DVec3; 2],
    axis: usize,
    side: Side,
    place: impl Fn(DVec3) -> DVec3,
    material: u32,
    with_uvs: bool,
) -> [Triangle; 2] {
    let positive = matches!(side, Side::Positive);
    // The axes of u and v, and whether u and v run towards their negative ends.
    let (u_axis, v_axis, u_back, v_back) = match axis {
        0 => (2, 1, positive, false),
        1 => (0, 2, false, positive),
        _ => (0, 1, !positive, false),
    };
    let ends = [lower.to_array(), upper.to_array()];
    let corner = |u: usize, v: usize| {
        let mut point = ends[usize::from(positive)];
        point[u_axis] = ends[u ^ usize::from(u_back)][u_axis];
        point[v_axis] = ends[v ^ usize::from(v_back)][v_axis];
        place(DVec3::from_array(point))
    };
    [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]].map(|corners| Triangle {
        vertices: corners.map(|[u, v]| corner(u, v)),
        uvs: with_uvs.then(|| corners.map(|[u, v]| Vec2::new(u as f32, v as f32))),
        material,
    })
}
