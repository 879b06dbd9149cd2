//! Checker patterns, whose colours may be those of other materials.

use glam::Vec3;

use super::super::fault::{Fault, Read};
use super::super::table::Table;
use super::super::value::Value;
use super::names::Materials;
use crate::material::{Checker, CheckerSpace};
use crate::scene::validate::MAX_COORDINATE;

const CHECKER_KEYS: &[&str] = &["checker", "size", "space"];

/// A pattern whose materials have not been looked up.
pub(in crate::scene::toml) struct CheckerText {
    colors: [ColorText; 2],
    /// The pattern; its colours are white.
    pub(super) pattern: Checker,
}

/// A colour, or the material with that diffuse colour.
enum ColorText {
    Color(Vec3),
    Named {
        name: String,
        /// Offset of the name in the text.
        at: usize,
        /// The key as named in messages.
        key: String,
    },
}

/// Whether a value is a table with a checker pattern.
pub(super) fn is_checker(value: &Value<'_>) -> bool {
    value.value.get_ref().as_table().is_some_and(|table| table.contains_key("checker"))
}

pub(super) fn checker(value: Value<'_>) -> Read<CheckerText> {
    let owner = value.to_string();
    let table = Table::open(&owner, value.value, CHECKER_KEYS)?;
    let fits = |n: f64| n as f32 > 0.0 && n <= MAX_COORDINATE;
    let size = table.read("size", |value| value.number("above 0", fits))?.unwrap_or(1.0) as f32;
    let space = table.read("space", |value| value.word(&CheckerSpace::WORDS))?;
    let [even, odd] = table.required("checker")?.array("an array of two colours or names of materials")?;
    Ok(CheckerText {
        colors: [color(even)?, color(odd)?],
        pattern: Checker { colors: [Vec3::ONE; 2], size, space: space.unwrap_or(CheckerSpace::Object) },
    })
}

fn color(value: Value<'_>) -> Read<ColorText> {
    match value.value.get_ref().as_str() {
        Some(name) => {
            Ok(ColorText::Named { name: name.to_owned(), at: value.start(), key: value.to_string() })
        }
        None if value.value.get_ref().is_array() => Ok(ColorText::Color(value.color(1.0)?)),
        None => Err(value.must_be("made of colours or names of materials")),
    }
}

impl CheckerText {
    /// The pattern with the colours of its materials.
    ///
    /// # Errors
    /// An unknown material, or one without a single diffuse colour.
    pub(in crate::scene::toml) fn resolved(&self, materials: &Materials) -> Read<Checker> {
        let [even, odd] = &self.colors;
        let colors = [even.resolved(materials)?, odd.resolved(materials)?];
        Ok(Checker { colors, ..self.pattern })
    }
}

impl ColorText {
    fn resolved(&self, materials: &Materials) -> Read<Vec3> {
        match self {
            Self::Color(color) => Ok(*color),
            Self::Named { name, at, key } => {
                materials.diffuse_of(name, key).map_err(|message| Fault::at(*at, message))
            }
        }
    }
}
