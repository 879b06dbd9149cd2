//! The tables `[material.NAME]`, and references to them by name.

use std::collections::BTreeMap;
use std::path::PathBuf;

use glam::Vec3;

use super::fault::{Read, shortened, suggestion};
use super::table::Table;
use super::value::Value;
use crate::material::{MAX_EXPONENT, Material};
use crate::scene::validate::MAX_LIGHT;
use crate::texture::{Filter, MAX_TILING, Tiling, Wrap};

pub(super) const MATERIAL_KEYS: &[&str] =
    &["diffuse", "specular", "exponent", "reflect", "transmit", "ior", "emission", "emission_strength"];

/// Default exponent of a material of the scene file.
const DEFAULT_EXPONENT: f32 = 50.0;

const TEXTURE_KEYS: &[&str] = &["texture", "filter", "wrap", "scale", "offset"];

/// A texture whose picture has not been loaded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TextureText {
    /// As the scene file names it, relative to that file.
    pub(crate) file: PathBuf,
    /// Offset of the file's name in the text, for messages.
    pub(crate) at: usize,
    pub(crate) filter: Filter,
    pub(crate) tiling: Tiling,
}

/// The textures of a material, at least one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TexturesText {
    pub(crate) diffuse: Option<TextureText>,
    pub(crate) emission: Option<TextureText>,
}

impl TexturesText {
    /// Whether one of the textures needs whole repeats of texture coordinates.
    pub(crate) fn distinguish_repeats(&self) -> bool {
        [&self.diffuse, &self.emission].into_iter().flatten().any(|text| text.tiling.distinguishes_repeats())
    }
}

pub(super) fn material(table: Table<'_>) -> Read<(Material, Option<TexturesText>)> {
    refuse_bounces(table)?;
    let exponent = |value: Value<'_>| {
        value.number("from 0 to 1e6", |n| (0.0..=f64::from(MAX_EXPONENT)).contains(&n)).map(|n| n as f32)
    };
    let diffuse = table.read("diffuse", |value| color_or_texture(value, 1.0))?;
    let (diffuse, texture) = diffuse.unwrap_or((Material::NEUTRAL.diffuse, None));
    let emission = table.read("emission", |value| color_or_texture(value, MAX_LIGHT))?;
    let (emission, emission_texture) = emission.unwrap_or((Vec3::ZERO, None));
    let strength = table.read("emission_strength", |value| {
        let brightest = emission.max_element().max(1.0);
        let most = f64::from(MAX_LIGHT / brightest);
        value.number("not negative, and times `emission` up to 1e30", |n| (0.0..=most).contains(&n))
    })?;
    let material = Material {
        diffuse,
        specular: table.read("specular", |value| value.color(1.0))?.unwrap_or(Vec3::ZERO),
        exponent: table.read("exponent", exponent)?.unwrap_or(DEFAULT_EXPONENT),
        emission: emission * strength.unwrap_or(1.0) as f32,
        ..Material::NEUTRAL
    };
    let textures = TexturesText { diffuse: texture, emission: emission_texture };
    let any = textures.diffuse.is_some() || textures.emission.is_some();
    Ok((material, any.then_some(textures)))
}

/// A colour; or white, with a texture.
fn color_or_texture(value: Value<'_>, limit: f32) -> Read<(Vec3, Option<TextureText>)> {
    if !value.table() {
        return Ok((value.color(limit)?, None));
    }
    let name = value.to_string();
    let table = Table::open(&name, value.value, TEXTURE_KEYS)?;
    let file = table.required("texture")?;
    let usual = Tiling::default();
    let pair = |value: Value<'_>| value.pair(MAX_TILING);
    let texture = TextureText {
        file: PathBuf::from(file.file_name("the name of a picture file")?),
        at: file.start(),
        filter: table.read("filter", |value| value.word(&Filter::WORDS))?.unwrap_or(Filter::Bilinear),
        tiling: Tiling {
            wrap: table.read("wrap", |value| value.word(&Wrap::WORDS))?.unwrap_or(usual.wrap),
            scale: table.read("scale", pair)?.unwrap_or(usual.scale),
            offset: table.read("offset", pair)?.unwrap_or(usual.offset),
        },
    };
    Ok((Vec3::ONE, Some(texture)))
}

fn refuse_bounces(table: Table<'_>) -> Read<()> {
    for key in ["reflect", "transmit"] {
        let Some(value) = table.get(key) else { continue };
        if value.number("from 0 to 1", |n| (0.0..=1.0).contains(&n))? > 0.0 {
            return Err(value.not_yet("a material that reflects or transmits", "use 0"));
        }
    }
    // Without transmission the index of refraction has no effect.
    table.read("ior", |value| value.number("above 0", |n| n > 0.0)).map(drop)
}

/// The materials of the scene by name.
#[derive(Default)]
pub(super) struct Materials {
    names: BTreeMap<String, u32>,
    values: Vec<Material>,
    /// Textures by the index of their material.
    textures: BTreeMap<u32, TexturesText>,
    neutral: Option<u32>,
}

impl Materials {
    /// Materials with these names. Their values are set by [`Materials::define`], and neutral until then.
    pub(super) fn named(names: Vec<String>) -> Self {
        let values = vec![Material::NEUTRAL; names.len()];
        let names = names.into_iter().zip(0..).collect();
        Self { names, values, ..Self::default() }
    }

    pub(super) fn define(&mut self, index: usize, (material, textures): (Material, Option<TexturesText>)) {
        if let Some(value) = self.values.get_mut(index) {
            *value = material;
            self.textures.extend(textures.map(|textures| (index as u32, textures)));
        }
    }

    pub(super) fn has_texture(&self, index: u32) -> bool {
        self.textures.contains_key(&index)
    }

    /// Whether a texture of a material needs whole repeats of texture coordinates.
    pub(super) fn distinguishes_repeats(&self, index: u32) -> bool {
        self.textures.get(&index).is_some_and(TexturesText::distinguish_repeats)
    }

    /// The index of the `material` of a table, if it has one.
    pub(super) fn referred(&self, table: Table<'_>) -> Read<Option<u32>> {
        table.read("material", |value| {
            let name = value.text()?;
            self.names.get(name).copied().ok_or_else(|| {
                let name = shortened(name);
                let known = self.names.keys().map(String::as_str);
                let hint = suggestion(&name, known, |list| {
                    let list = if list.is_empty() { "none".into() } else { list };
                    format!("; the file defines {list}. Add [material.{name}], or use one of those")
                });
                value.fault(format!("unknown material `{name}` in {}{hint}", value.owner))
            })
        })
    }

    /// The index of the `material` of a table, or of the neutral material.
    pub(super) fn referred_or_neutral(&mut self, table: Table<'_>) -> Read<u32> {
        Ok(self.referred(table)?.unwrap_or_else(|| self.neutral()))
    }

    /// The index as in [`Materials::referred_or_neutral`], for objects without texture coordinates. `instead` is the
    /// remedy in the message for a textured material.
    pub(super) fn referred_plain(&mut self, table: Table<'_>, instead: &str) -> Read<u32> {
        let index = self.referred_or_neutral(table)?;
        match table.get("material").filter(|_| self.has_texture(index)) {
            None => Ok(index),
            Some(value) => Err(value.fault(format!(
                "{value} has a texture, but there are no texture coordinates for it; {instead}"
            ))),
        }
    }

    fn neutral(&mut self) -> u32 {
        *self.neutral.get_or_insert_with(|| {
            self.values.push(Material::NEUTRAL);
            (self.values.len() - 1) as u32
        })
    }

    /// The materials, and the textures by the index of their material.
    pub(super) fn into_parts(self) -> (Vec<Material>, BTreeMap<u32, TexturesText>) {
        (self.values, self.textures)
    }
}
