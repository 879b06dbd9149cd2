//! The tables `[material.NAME]`.

mod bounce;
mod checker;
mod metallic;
mod names;
mod texture;

use glam::Vec3;

use super::fault::Read;
use super::table::Table;
use super::value::Value;
use super::{Reading, knobs};
use crate::material::{MAX_EXPONENT, Material};
use crate::scene::data::Integrator;
use crate::scene::validate::MAX_LIGHT;

pub(in crate::scene) use texture::{TextureText, TexturesText};

pub(super) use checker::CheckerText;
pub(super) use names::Materials;

pub(super) const MATERIAL_KEYS: &[&str] = &[
    "diffuse",
    "specular",
    "exponent",
    "reflect",
    "transmit",
    "ior",
    "fresnel",
    "thin",
    "absorption",
    "casts_shadow",
    "emission",
    "emission_strength",
    "normal_map",
    "metallic",
    "roughness",
    "transmission",
    "specular_factor",
    metallic::TEXTURE_KEY,
];

/// Default exponent of a material of the scene file.
const DEFAULT_EXPONENT: f32 = 50.0;

/// A material whose textures have not been loaded, and whose pattern may name other materials.
pub(super) struct MaterialText {
    pub(super) material: Material,
    pub(super) textures: Option<TexturesText>,
    pub(super) checker: Option<CheckerText>,
}

/// Reads a material of a scene that is rendered by `integrator`.
pub(super) fn material(
    table: Table<'_>,
    integrator: &Integrator,
    reading: &mut Reading,
) -> Read<MaterialText> {
    let exponent = |value: Value<'_>| {
        value.number("from 0 to 1e6", |n| (0.0..=f64::from(MAX_EXPONENT)).contains(&n)).map(|n| n as f32)
    };
    let diffuse = table.get("diffuse");
    let checker = diffuse.filter(checker::is_checker).map(checker::checker).transpose()?;
    let diffuse = match (diffuse, &checker) {
        (Some(value), None) => texture::color_or_texture(value, 1.0)?,
        (None, _) => (Material::NEUTRAL.diffuse, None),
        (_, Some(_)) => (Vec3::ONE, None),
    };
    let emission = table.read("emission", |value| texture::color_or_texture(value, MAX_LIGHT))?;
    let (emission, emission_texture) = emission.unwrap_or((Vec3::ZERO, None));
    let strength = table.read("emission_strength", |value| {
        let brightest = emission.max_element().max(1.0);
        let most = f64::from(MAX_LIGHT / brightest);
        value.number("not negative, and times `emission` up to 1e30", |n| (0.0..=most).contains(&n))
    })?;
    let textures = TexturesText {
        diffuse: diffuse.1,
        emission: emission_texture,
        normal_map: table.read("normal_map", texture::normal_map)?,
        metallic_roughness: table.read(metallic::TEXTURE_KEY, texture::only_texture)?,
    };
    let material = Material {
        diffuse: diffuse.0,
        specular: table.read("specular", |value| value.color(1.0))?.unwrap_or(Vec3::ZERO),
        exponent: table.read("exponent", exponent)?.unwrap_or(DEFAULT_EXPONENT),
        emission: emission * strength.unwrap_or(1.0) as f32,
        casts_shadow: table.read("casts_shadow", |value| value.boolean())?.unwrap_or(true),
        checker: checker.as_ref().map(|text| text.pattern),
        ..Material::NEUTRAL
    };
    if *integrator == Integrator::Direct {
        reading.idle(table, metallic::TEXTURE_KEY, knobs::with(integrator));
    }
    let material = bounce::bounces(table, material)?;
    let material = match metallic::model(table)? {
        Some(model) => metallic::applied(table, material, model, reading),
        None => {
            bounce::warn_about_unused_keys(table, &material, reading);
            material
        }
    };
    Ok(MaterialText { material, textures: Some(textures).filter(|all| !all.is_empty()), checker })
}
