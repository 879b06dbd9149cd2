//! `[material.NAME]`, and the names by which the other tables refer to them.

use glam::Vec3;

use super::super::{MAX_EXPONENT, Material};
use super::fault::{Read, shortened, suggestion};
use super::table::Table;
use super::value::Value;

pub(super) const MATERIAL_KEYS: &[&str] = &["diffuse", "specular", "exponent", "reflect", "transmit", "ior"];

/// The exponent of a material that gives only a specular colour.
const DEFAULT_EXPONENT: f32 = 50.0;

pub(super) fn material(table: Table<'_>) -> Read<Material> {
    refuse_bounces(table)?;
    let exponent = |value: Value<'_>| {
        value.number("from 0 to 1e6", |n| (0.0..=f64::from(MAX_EXPONENT)).contains(&n)).map(|n| n as f32)
    };
    Ok(Material {
        diffuse: table.read("diffuse", diffuse)?.unwrap_or(Material::NEUTRAL.diffuse),
        specular: table.read("specular", |value| value.color(1.0))?.unwrap_or(Vec3::ZERO),
        exponent: table.read("exponent", exponent)?.unwrap_or(DEFAULT_EXPONENT),
    })
}

fn diffuse(value: Value<'_>) -> Read<Vec3> {
    if value.table() {
        return Err(value.not_yet("a texture", "give a colour, such as [0.8, 0.8, 0.8]"));
    }
    value.color(1.0)
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
    neutral: Option<u32>,
}

impl Materials {
    /// Materials of these names; their values follow by [`Materials::define`], the neutral one until then.
    pub(super) fn named(names: Vec<String>) -> Self {
        let values = vec![Material::NEUTRAL; names.len()];
        Self { names, values, neutral: None }
    }

    pub(super) fn define(&mut self, index: usize, material: Material) {
        if let Some(value) = self.values.get_mut(index) {
            *value = material;
        }
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

    fn neutral(&mut self) -> u32 {
        *self.neutral.get_or_insert_with(|| {
            self.values.push(Material::NEUTRAL);
            (self.values.len() - 1) as u32
        })
    }

    pub(super) fn into_values(self) -> Vec<Material> {
        self.values
    }
}
