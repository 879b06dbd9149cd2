//! `[material.NAME]`, and the names by which the other tables refer to them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use glam::Vec3;

use super::super::{Filter, MAX_EXPONENT, Material};
use super::fault::{Read, shortened, suggestion};
use super::table::Table;
use super::value::Value;

pub(super) const MATERIAL_KEYS: &[&str] = &["diffuse", "specular", "exponent", "reflect", "transmit", "ior"];

/// The exponent of a material that gives only a specular colour.
const DEFAULT_EXPONENT: f32 = 50.0;

const TEXTURE_KEYS: &[&str] = &["texture", "filter"];

/// A texture whose picture has not been loaded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TextureText {
    /// As the scene file names it, relative to that file.
    pub(crate) file: PathBuf,
    /// Offset of the file's name in the text, for messages.
    pub(crate) at: usize,
    pub(crate) filter: Filter,
}

pub(super) fn material(table: Table<'_>) -> Read<(Material, Option<TextureText>)> {
    refuse_bounces(table)?;
    let exponent = |value: Value<'_>| {
        value.number("from 0 to 1e6", |n| (0.0..=f64::from(MAX_EXPONENT)).contains(&n)).map(|n| n as f32)
    };
    let (diffuse, texture) = table.read("diffuse", diffuse)?.unwrap_or((Material::NEUTRAL.diffuse, None));
    let material = Material {
        diffuse,
        specular: table.read("specular", |value| value.color(1.0))?.unwrap_or(Vec3::ZERO),
        exponent: table.read("exponent", exponent)?.unwrap_or(DEFAULT_EXPONENT),
        texture: None,
    };
    Ok((material, texture))
}

/// A colour, or white with a texture.
fn diffuse(value: Value<'_>) -> Read<(Vec3, Option<TextureText>)> {
    if !value.table() {
        return Ok((value.color(1.0)?, None));
    }
    let name = value.to_string();
    let table = Table::open(&name, value.value, TEXTURE_KEYS)?;
    let file = table.required("texture")?;
    if file.text()?.is_empty() {
        return Err(file.must_be("the name of a picture file"));
    }
    let texture = TextureText {
        file: PathBuf::from(file.text()?),
        at: file.start(),
        filter: table.read("filter", |value| value.word(&Filter::WORDS))?.unwrap_or(Filter::Bilinear),
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
    names: Vec<String>,
    values: Vec<Material>,
    /// By the index of their material.
    textures: BTreeMap<u32, TextureText>,
    neutral: Option<u32>,
}

impl Materials {
    /// Materials of these names; their values follow by [`Materials::define`], the neutral one until then.
    pub(super) fn named(names: Vec<String>) -> Self {
        let values = vec![Material::NEUTRAL; names.len()];
        Self { names, values, ..Self::default() }
    }

    pub(super) fn define(&mut self, index: usize, (material, texture): (Material, Option<TextureText>)) {
        if let Some(value) = self.values.get_mut(index) {
            *value = material;
            self.textures.extend(texture.map(|texture| (index as u32, texture)));
        }
    }

    pub(super) fn has_texture(&self, index: u32) -> bool {
        self.textures.contains_key(&index)
    }

    /// The index that the `material` of a table refers to, if it has one.
    pub(super) fn referred(&self, table: Table<'_>) -> Read<Option<u32>> {
        table.read("material", |value| {
            let name = value.text()?;
            let found = self.names.iter().position(|known| known == name);
            found.map(|index| index as u32).ok_or_else(|| {
                let name = shortened(name);
                let known = self.names.iter().map(String::as_str);
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
    pub(super) fn into_parts(self) -> (Vec<Material>, BTreeMap<u32, TextureText>) {
        (self.values, self.textures)
    }
}
