//! Statements that `tobj` does not read: emission, unlit materials, cut-outs, pictures and their tiling.

use glam::Vec3;

use super::super::super::warnings::Warnings;
use super::super::lines::Line;
use super::super::picture::{Place, picture};
use super::values::{color, number};
use crate::mesh::{NamedMaterial, TextureFile};

/// The largest emission that is read.
const MAX_EMISSION: f64 = 1e9;

/// Reads one of these statements into a material; ignores all others.
pub(super) fn read(
    line: &Line<'_>,
    place: &Place<'_>,
    material: &mut NamedMaterial,
    warnings: &mut Warnings,
) -> Result<(), String> {
    match line.keyword().to_ascii_lowercase().as_str() {
        "illum" => material.material.unlit = number(line)? == 0.0,
        "ke" => {
            let channels = color(line)?.map(|channel| channel.clamp(0.0, MAX_EMISSION) as f32);
            material.material.emission = Vec3::from_array(channels);
        }
        "map_ke" => material.emission_texture = Some(texture(line, place, warnings)?),
        "map_kd" => material.texture = Some(texture(line, place, warnings)?),
        "map_d" => material.cutout = Some(texture(line, place, warnings)?),
        _ => {}
    }
    Ok(())
}

fn texture(line: &Line<'_>, place: &Place<'_>, warnings: &mut Warnings) -> Result<TextureFile, String> {
    let (file, tiling) = picture(line, place, warnings)?;
    Ok(TextureFile { file, tiling })
}

/// Completes a material whose statements are all read.
pub(super) fn finish(material: &mut NamedMaterial) {
    // `Ke` is a factor of its texel. Without it, or with 0, the map alone is meant.
    if material.emission_texture.is_some() && !material.material.is_emissive() {
        material.material.emission = Vec3::ONE;
    }
}
