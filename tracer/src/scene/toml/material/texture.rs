//! Textures of materials: a picture file with its lookup.

use std::path::PathBuf;

use glam::Vec3;

use super::super::fault::Read;
use super::super::table::Table;
use super::super::value::Value;
use crate::scene::validate::MAX_NORMAL_STRENGTH;
use crate::texture::{Filter, MAX_TILING, Tiling, Wrap};

const TEXTURE_KEYS: &[&str] = &["texture", "filter", "wrap", "scale", "offset"];
const NORMAL_MAP_KEYS: &[&str] = &["texture", "strength", "filter", "wrap", "scale", "offset"];

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

/// A normal map whose picture has not been loaded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NormalMapText {
    pub(crate) texture: TextureText,
    /// Factor of the tilt.
    pub(crate) strength: f32,
}

/// The textures of a material, at least one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TexturesText {
    pub(crate) diffuse: Option<TextureText>,
    pub(crate) emission: Option<TextureText>,
    pub(crate) normal_map: Option<NormalMapText>,
    pub(crate) metallic_roughness: Option<TextureText>,
}

impl TexturesText {
    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.all().next().is_none()
    }

    /// Whether one of the textures needs whole repeats of texture coordinates.
    pub(crate) fn distinguish_repeats(&self) -> bool {
        self.all().any(|text| text.tiling.distinguishes_repeats())
    }

    fn all(&self) -> impl Iterator<Item = &TextureText> {
        let normals = self.normal_map.as_ref().map(|map| &map.texture);
        [self.diffuse.as_ref(), self.emission.as_ref(), normals, self.metallic_roughness.as_ref()]
            .into_iter()
            .flatten()
    }
}

/// A colour; or white, with a texture.
pub(super) fn color_or_texture(value: Value<'_>, limit: f32) -> Read<(Vec3, Option<TextureText>)> {
    if !value.table() {
        return Ok((value.color(limit)?, None));
    }
    Ok((Vec3::ONE, Some(only_texture(value)?)))
}

/// A texture.
pub(super) fn only_texture(value: Value<'_>) -> Read<TextureText> {
    let name = value.to_string();
    texture(Table::open(&name, value.value, TEXTURE_KEYS)?)
}

pub(super) fn normal_map(value: Value<'_>) -> Read<NormalMapText> {
    let name = value.to_string();
    let table = Table::open(&name, value.value, NORMAL_MAP_KEYS)?;
    let most = f64::from(MAX_NORMAL_STRENGTH);
    let strength = |value: Value<'_>| value.number("from 0 to 100", |n| (0.0..=most).contains(&n));
    Ok(NormalMapText {
        texture: texture(table)?,
        strength: table.read("strength", strength)?.unwrap_or(1.0) as f32,
    })
}

fn texture(table: Table<'_>) -> Read<TextureText> {
    let file = table.required("texture")?;
    let usual = Tiling::default();
    let pair = |value: Value<'_>| value.pair(MAX_TILING);
    Ok(TextureText {
        file: PathBuf::from(file.file_name("the name of a picture file")?),
        at: file.start(),
        filter: table.read("filter", |value| value.word(&Filter::WORDS))?.unwrap_or(Filter::Bilinear),
        tiling: Tiling {
            wrap: table.read("wrap", |value| value.word(&Wrap::WORDS))?.unwrap_or(usual.wrap),
            scale: table.read("scale", pair)?.unwrap_or(usual.scale),
            offset: table.read("offset", pair)?.unwrap_or(usual.offset),
        },
    })
}
