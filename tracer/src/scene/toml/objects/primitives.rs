//! The tables `[[sphere]]`, `[[plane]]` and `[[disk]]`.

use glam::DVec3;

use super::super::Reading;
use super::super::fault::Read;
use super::super::keys::{Keys, SPHERE_KEY_KEYS};
use super::super::material::Materials;
use super::super::table::Table;
use crate::scene::data::{Disk, Plane, Sphere};

pub(in crate::scene::toml) const SPHERE_KEYS: &[&str] =
    &["name", "center", "radius", "material", "inside_out", "uv_rotate", "center_end", "key"];
pub(in crate::scene::toml) const PLANE_KEYS: &[&str] = &["point", "normal", "material", "size"];
pub(in crate::scene::toml) const DISK_KEYS: &[&str] = &["name", "center", "normal", "radius", "material"];

/// A sphere as it is when the shutter opens, and its centre when the shutter closes, if that is elsewhere.
pub(in crate::scene::toml) type MovingSphere = (Sphere, Option<DVec3>);

/// Reads a sphere.
pub(in crate::scene::toml) fn sphere(
    table: Table<'_>,
    materials: &mut Materials,
    reading: &mut Reading,
) -> Read<MovingSphere> {
    let material = materials.referred_or_neutral(table)?;
    let keys = Keys::of(table, "[[sphere.key]]", SPHERE_KEY_KEYS, reading)?;
    keys.contradict(table, &["center_end"])?;
    let center = match keys.vector_or(table, "center", reading)? {
        Some(center) => center,
        None => table.required("center")?.vector()?,
    };
    let radius = keys.number_or(table, "radius", |value| value.positive(), reading)?;
    reading.note_end(table, "center_end");
    let center = reading.shutter.ends(center, table.read("center_end", |value| value.vector())?);
    let sphere = Sphere {
        center: center.opening,
        radius: radius.map_or_else(|| table.required("radius")?.positive(), Ok)?,
        material,
        inside_out: table.read("inside_out", |value| value.boolean())?.unwrap_or(false),
        uv_rotate: table.read("uv_rotate", |value| value.vector())?.unwrap_or(DVec3::ZERO),
    };
    if !materials.needs_uvs(material) {
        reading.idle(table, "uv_rotate", "without a texture");
    }
    Ok((sphere, (center.opening != center.closing).then_some(center.closing)))
}

pub(in crate::scene::toml) fn plane(
    table: Table<'_>,
    materials: &mut Materials,
    reading: &mut Reading,
) -> Read<Plane> {
    let material = materials.referred_or_neutral(table)?;
    let plane = Plane {
        point: table.required("point")?.vector()?,
        normal: table.required("normal")?.direction()?,
        material,
        size: table.read("size", |value| value.positive())?.unwrap_or(1.0),
    };
    if !materials.needs_uvs(material) {
        reading.idle(table, "size", "without a texture");
    }
    Ok(plane)
}

pub(in crate::scene::toml) fn disk(table: Table<'_>, materials: &mut Materials) -> Read<Disk> {
    Ok(Disk {
        center: table.required("center")?.vector()?,
        normal: table.required("normal")?.direction()?,
        radius: table.required("radius")?.positive()?,
        material: materials.referred_plain(table, "use a material with a colour, or a rectangle")?,
    })
}
