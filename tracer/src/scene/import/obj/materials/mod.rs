//! The text of a material library (MTL). Faults and unsupported statements are reported once per kind as warnings, and never
//! make the model fail.

mod optics;
mod statements;
mod surface;
#[cfg(test)]
mod tests;
mod values;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::panic::catch_unwind;

use glam::Vec3;

use super::super::printed::excerpt;
use super::super::warnings::Warnings;
use super::lines::lines;
use super::picture::Place;
use crate::material::Material;
use crate::mesh::NamedMaterial;
use optics::{Optics, Rest};
use statements::{spelled, statement};
use values::{MAX_SHOWN, SMALLEST_EXPONENT};

/// Materials by their [`plain_name`].
pub(super) type Library = BTreeMap<String, NamedMaterial>;

/// The normalised name of a material, the same in models and libraries: without quotes, and with single blanks.
pub(super) fn plain_name(name: &str) -> Cow<'_, str> {
    let mut name = name.trim_ascii();
    for quote in ['"', '\''] {
        name =
            name.strip_prefix(quote).and_then(|rest| rest.strip_suffix(quote)).unwrap_or(name).trim_ascii();
    }
    let is_plain = !name.contains(['\t', '\x0c']) && !name.contains("  ");
    if is_plain {
        Cow::Borrowed(name)
    } else {
        name.split_ascii_whitespace().collect::<Vec<_>>().join(" ").into()
    }
}

/// A material under construction: its `newmtl` line and what `tobj` does not read.
struct Head {
    line: usize,
    name: String,
    /// Emission, pictures and flags, which `tobj` does not read.
    surface: NamedMaterial,
    optics: Optics,
}

/// The materials of a library's text.
pub(super) fn parse(text: &str, place: &Place<'_>, warnings: &mut Warnings) -> Library {
    let (clean, heads) = clean(text, place, warnings);
    // `tobj` panics on some malformed input. The cleaned text should have none, but that is not guaranteed.
    let parsed = catch_unwind(|| tobj::load_mtl_buf(&mut clean.as_bytes()));
    let Ok(Ok((materials, _))) = parsed else {
        warnings.at_file("the material library cannot be read, and is left out");
        return Library::new();
    };
    let mut library = Library::new();
    for material in materials {
        let head = material.name.parse().ok().and_then(|index: usize| heads.get(index));
        if let Some(head) = head.filter(|head| !head.name.is_empty()) {
            define(&mut library, head, material, warnings);
        }
    }
    add_names_before_comments(&mut library);
    library
}

/// The text as `tobj` reads it, with the index of a material for its name, and the materials in their order.
fn clean(text: &str, place: &Place<'_>, warnings: &mut Warnings) -> (String, Vec<Head>) {
    let mut clean = String::new();
    let mut heads: Vec<Head> = Vec::new();
    for line in lines(text) {
        let keyword = spelled(line.keyword());
        if keyword == "newmtl" {
            if line.rest().is_empty() {
                warnings.at_line(line.number, "`newmtl` without a name; its material is left out");
            }
            // Numbers in place of names: `tobj` would change some names.
            let _ = writeln!(clean, "newmtl {}", heads.len());
            let surface = NamedMaterial::plain("", Material::NEUTRAL);
            let name = plain_name(line.rest()).into_owned();
            heads.push(Head { line: line.number, name, surface, optics: Optics::default() });
        } else if let Some(head) = heads.last_mut() {
            let read = surface::read(&line, place, &mut head.surface, warnings)
                .and_then(|()| head.optics.read(keyword, &line, warnings));
            match read.and_then(|()| statement(keyword, &line, warnings)) {
                Ok(statement) => clean.push_str(&statement),
                Err(message) => warnings.at_line(line.number, format!("{message}; the line is left out")),
            }
        } else {
            warnings.once("before newmtl", line.number, "statements before the first `newmtl` are left out");
        }
    }
    (clean, heads)
}

/// Adds materials whose `newmtl` line ends in a comment under the name before it, unless that name is taken.
fn add_names_before_comments(library: &mut Library) {
    let before_comment = |(name, material): (&String, &NamedMaterial)| {
        let (bare, _) = name.split_once(" #")?;
        Some((plain_name(bare).into_owned(), material.clone())).filter(|(bare, _)| !bare.is_empty())
    };
    let bare: Vec<_> = library.iter().filter_map(before_comment).collect();
    for (name, material) in bare {
        library.entry(name).or_insert(material);
    }
}

/// Adds a material. The last definition of a name counts.
fn define(library: &mut Library, head: &Head, material: tobj::Material, warnings: &mut Warnings) {
    if has_ambient_color(&material) {
        let message = "`Ka`: ambient light takes the colour of `Kd`, and `Ka` is left out";
        warnings.once("Ka", head.line, message);
    }
    if material.ambient_texture.is_some() && head.surface.texture.is_none() {
        warnings.once("map_Ka", head.line, "`map_Ka` without `map_Kd` is left out: ambient light takes `Kd`");
    }
    let named = convert(material, head, warnings);
    let name = excerpt(&head.name, MAX_SHOWN);
    if library.insert(head.name.clone(), named.clone()).is_some_and(|before| before != named) {
        warnings.at_line(
            head.line,
            format!("`{name}` is defined again, in another way: the last definition counts"),
        );
    }
}

/// Whether `Ka` means another colour in ambient light than in other light. A grey `Ka` is a default of many programs.
fn has_ambient_color(material: &tobj::Material) -> bool {
    let Some(ambient) = material.ambient else { return false };
    ambient.iter().any(|channel| *channel != ambient[0]) && material.diffuse != Some(ambient)
}

/// The material of the finished statements.
fn convert(material: tobj::Material, head: &Head, warnings: &mut Warnings) -> NamedMaterial {
    let mut surface = head.surface.clone();
    surface::finish(&mut surface);
    let color = |[r, g, b]: [f64; 3]| Vec3::new(r as f32, g as f32, b as f32);
    // Illumination models 0 and 1 have no highlights.
    let matt = material.illumination_model.is_some_and(|model| model < 2)
        || material.shininess.is_some_and(|exponent| exponent < SMALLEST_EXPONENT);
    let diffuse = match (material.diffuse.map(color), &surface.texture) {
        // `Kd` is a factor of the texel. Some programs write 0 for "the map alone", which would be black.
        (None | Some(Vec3::ZERO), Some(_)) => Vec3::ONE,
        (diffuse, _) => diffuse.unwrap_or(Material::NEUTRAL.diffuse),
    };
    let converted = Material {
        diffuse,
        specular: material.specular.filter(|_| !matt).map_or(Vec3::ZERO, color),
        exponent: material.shininess.map_or(Material::NEUTRAL.exponent, |ns| ns as f32),
        ..surface.material
    };
    let exponent = material.shininess;
    let rest = Rest { matt, exponent, cut_out: surface.cutout.is_some(), line: head.line };
    let material = head.optics.applied(converted, rest, warnings);
    NamedMaterial { name: head.name.clone(), material, ..surface }
}
