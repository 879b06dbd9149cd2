//! The metallic-roughness model of a material.

use super::super::Reading;
use super::super::fault::Read;
use super::super::table::Table;
use super::super::value::Value;
use crate::material::{Material, MetallicRoughness};

/// Keys that make a material metallic-roughness. [`TEXTURE_KEY`] is another one.
pub(super) const SHARE_KEYS: [&str; 4] = ["metallic", "roughness", "transmission", "specular_factor"];
pub(super) const TEXTURE_KEY: &str = "metallic_roughness_texture";

/// Default roughness of a metallic-roughness material.
const DEFAULT_ROUGHNESS: f32 = 0.5;

/// Keys of the other model.
const OTHER_MODEL: [&str; 5] = ["specular", "exponent", "reflect", "transmit", "fresnel"];

/// The model of a material whose keys request it. Its texture is not loaded yet.
pub(super) fn model(table: Table<'_>) -> Read<Option<MetallicRoughness>> {
    let share = |key: &'static str, usual: f32| {
        let share = |value: Value<'_>| value.number("from 0 to 1", |n| (0.0..=1.0).contains(&n));
        table.read(key, share).map(|given| given.map_or(usual, |n| n as f32))
    };
    let [metallic, roughness, transmission, specular_factor] = SHARE_KEYS;
    let textured = table.get(TEXTURE_KEY).is_some();
    // With a texture, the numbers are its factors.
    let model = MetallicRoughness {
        metallic: share(metallic, if textured { 1.0 } else { 0.0 })?,
        roughness: share(roughness, if textured { 1.0 } else { DEFAULT_ROUGHNESS })?,
        transmission: share(transmission, 0.0)?,
        specular_factor: share(specular_factor, 1.0)?,
        texture: None,
    };
    Ok((textured || SHARE_KEYS.iter().any(|key| table.get(key).is_some())).then_some(model))
}

/// The material with this model, and warnings about keys that have no effect with it.
pub(super) fn applied(
    table: Table<'_>,
    material: Material,
    model: MetallicRoughness,
    reading: &mut Reading,
) -> Material {
    for key in OTHER_MODEL {
        reading.idle(table, key, "on a metallic-roughness material");
    }
    if model.transmission == 0.0 {
        for key in ["absorption", "thin"] {
            reading.idle(table, key, "without `transmission`");
        }
    } else if material.thin {
        reading.idle(table, "absorption", "on a thin material, which has no inside");
    }
    material.with_metallic_roughness(model)
}
