//! The materials of a scene file, and references to them by name.

use std::collections::BTreeMap;

use glam::Vec3;

use super::super::fault::{Read, shortened, suggestion};
use super::super::table::Table;
use super::MaterialText;
use super::texture::TexturesText;
use crate::material::{Checker, CheckerSpace, Material};

/// The materials of the scene by name.
#[derive(Default)]
pub(in crate::scene::toml) struct Materials {
    names: BTreeMap<String, u32>,
    values: Vec<Material>,
    /// Textures by the index of their material.
    textures: BTreeMap<u32, TexturesText>,
    neutral: Option<u32>,
}

impl Materials {
    /// Materials with these names. Their values are set by [`Materials::define`], and neutral until then.
    pub(in crate::scene::toml) fn named(names: Vec<String>) -> Self {
        let values = vec![Material::NEUTRAL; names.len()];
        let names = names.into_iter().zip(0..).collect();
        Self { names, values, ..Self::default() }
    }

    /// Sets the value of a material, and its textures. The colours of its checker pattern follow by
    /// [`Materials::set_checker`].
    pub(in crate::scene::toml) fn define(&mut self, index: usize, text: MaterialText) {
        if let Some(value) = self.values.get_mut(index) {
            *value = text.material;
            self.textures.extend(text.textures.map(|textures| (index as u32, textures)));
        }
    }

    pub(in crate::scene::toml) fn set_checker(&mut self, index: usize, checker: Checker) {
        if let Some(value) = self.values.get_mut(index) {
            value.checker = Some(checker);
        }
    }

    fn has_texture(&self, index: u32) -> bool {
        self.textures.contains_key(&index)
    }

    /// The checker pattern of a material.
    fn checker(&self, index: u32) -> Option<Checker> {
        self.values.get(index as usize)?.checker
    }

    /// Whether a material needs texture coordinates.
    pub(in crate::scene::toml) fn needs_uvs(&self, index: u32) -> bool {
        self.has_texture(index)
            || self.checker(index).is_some_and(|checker| checker.space == CheckerSpace::Uv)
    }

    /// Whether a material needs whole repeats of texture coordinates.
    pub(in crate::scene::toml) fn distinguishes_repeats(&self, index: u32) -> bool {
        self.textures.get(&index).is_some_and(TexturesText::distinguish_repeats)
            || self.checker(index).is_some_and(|checker| checker.space == CheckerSpace::Uv)
    }

    /// The diffuse colour of a material by its name. The error is a message with the place that names it.
    pub(super) fn diffuse_of(&self, name: &str, place: &str) -> Result<Vec3, String> {
        let index = self.find(name, place)?;
        let material = self.values.get(index as usize).unwrap_or(&Material::NEUTRAL);
        let textured = self.textures.get(&index).is_some_and(|textures| textures.diffuse.is_some());
        if textured || material.checker.is_some() {
            let name = shortened(name);
            let message =
                format!("the material `{name}` of {place} has a texture or a pattern, not one colour");
            return Err(message);
        }
        Ok(material.diffuse)
    }

    /// The index of a material. The error is a message with the place that names it.
    fn find(&self, name: &str, place: &str) -> Result<u32, String> {
        self.names.get(name).copied().ok_or_else(|| {
            let name = shortened(name);
            let known = self.names.keys().map(String::as_str);
            let hint = suggestion(&name, known, |list| {
                let list = if list.is_empty() { "none".into() } else { list };
                format!("; the file defines {list}. Add [material.{name}], or use one of those")
            });
            format!("unknown material `{name}` in {place}{hint}")
        })
    }

    /// The index of the `material` of a table, if it has one.
    pub(in crate::scene::toml) fn referred(&self, table: Table<'_>) -> Read<Option<u32>> {
        table.read("material", |value| {
            self.find(value.text()?, value.owner).map_err(|message| value.fault(message))
        })
    }

    /// The index of the `material` of a table, or of the neutral material.
    pub(in crate::scene::toml) fn referred_or_neutral(&mut self, table: Table<'_>) -> Read<u32> {
        Ok(self.referred(table)?.unwrap_or_else(|| self.neutral()))
    }

    /// The index as in [`Materials::referred_or_neutral`], for objects without texture coordinates. `instead` is the
    /// remedy in the message for a textured material.
    pub(in crate::scene::toml) fn referred_plain(&mut self, table: Table<'_>, instead: &str) -> Read<u32> {
        let index = self.referred_or_neutral(table)?;
        match table.get("material").filter(|_| self.needs_uvs(index)) {
            None => Ok(index),
            Some(value) => {
                let what = if self.has_texture(index) { "a texture" } else { "a pattern" };
                Err(value.fault(format!(
                    "{value} has {what}, but there are no texture coordinates for it; {instead}"
                )))
            }
        }
    }

    fn neutral(&mut self) -> u32 {
        *self.neutral.get_or_insert_with(|| {
            self.values.push(Material::NEUTRAL);
            (self.values.len() - 1) as u32
        })
    }

    /// The materials, and the textures by the index of their material.
    pub(in crate::scene::toml) fn into_parts(self) -> (Vec<Material>, BTreeMap<u32, TexturesText>) {
        (self.values, self.textures)
    }
}
