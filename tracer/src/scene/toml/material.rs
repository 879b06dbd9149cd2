//! `[material.NAME]`, and the names by which the other tables refer to them.

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

/// The exponent of a material that gives only a specular colour.
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

/// The textures of a material; one at least.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TexturesText {
    pub(crate) diffuse: Option<TextureText>,
    pub(crate) emission: Option<TextureText>,
}

impl TexturesText {
    /// Whether one of them wants the whole repeats of texture coordinates.
    pub(crate) fn tell_repeats_apart(&self) -> bool {
        [&self.diffuse, &self.emission].into_iter().flatten().any(|text| text.tiling.tells_repeats_apart())
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

/// A colour, or white with a texture.
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
    // Without transmission the index of refraction changes nothing.
    table.read("ior", |value| value.number("above 0", |n| n > 0.0)).map(drop)
}

/// The scene's materials, found by name.
#[derive(Default)]
pub(super) struct Materials {
    names: BTreeMap<String, u32>,
    values: Vec<Material>,
    /// By the index of their material.
    textures: BTreeMap<u32, TexturesText>,
    neutral: Option<u32>,
}

impl Materials {
    /// Materials of these names; their values follow by [`Materials::define`], the neutral one until then.
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

    /// Whether a texture of a material wants the whole repeats of texture coordinates.
    pub(super) fn tells_repeats_apart(&self, index: u32) -> bool {
        self.textures.get(&index).is_some_and(TexturesText::tell_repeats_apart)
    }

    /// The index that the `material` of a table refers to, if it has one.
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

    /// As [`Materials::referred`], and the neutral material where none is named.
    pub(super) fn referred_or_neutral(&mut self, table: Table<'_>) -> Read<u32> {
        Ok(self.referred(table)?.unwrap_or_else(|| self.neutral()))
    }

    /// As [`Materials::referred_or_neutral`], for what has no texture coordinates: `instead` says what to do.
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

    /// The materials, and the textures of some by their index.
    pub(super) fn into_parts(self) -> (Vec<Material>, BTreeMap<u32, TexturesText>) {
        (self.values, self.textures)
    }
}
