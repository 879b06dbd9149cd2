//! The scene file: TOML in, plain data with places for messages out. Nothing is opened here but the text itself.
//!
//! The text is parsed into tables that know where each value stands, and every table is read by hand with the keys it
//! may have. So nothing that the file says is ignored, and every complaint names line and column.

mod fault;
mod knobs;
mod light;
mod material;
mod objects;
mod table;
mod value;
mod view;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use glam::Vec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use fault::{FirstFault, Read};
use material::Materials;
use table::{Table, tables_of};
use value::Value;

use crate::material::Material;
use crate::scene::data::{Background, Light, Plane, RenderSettings, Sphere, Triangle};
use crate::scene::validate::{
    MAX_LIGHT, MAX_LIGHTS, MAX_MATERIALS, MAX_MODELS, MAX_PLANES, MAX_SPHERES, MAX_TRIANGLES,
};

pub(super) use fault::{Fault, place};
pub(super) use material::{TextureText, TexturesText};
pub(super) use objects::ModelText;
pub(super) use view::{Aim, CameraText};

const KEYS: &[&str] = &[
    "ambient",
    "render",
    "camera",
    "background",
    "light",
    "material",
    "model",
    "sphere",
    "plane",
    "triangle",
];

/// What a scene file says. Models are not loaded; what is left out is left to the loader.
#[derive(Clone, Debug)]
pub(super) struct SceneText {
    /// Zero where the file has none.
    pub(super) ambient: Vec3,
    pub(super) render: RenderSettings,
    pub(super) camera: Option<CameraText>,
    /// Black where the file has none.
    pub(super) background: Background,
    pub(super) lights: Vec<Light>,
    pub(super) materials: Vec<Material>,
    /// By the index of their material.
    pub(super) textures: BTreeMap<u32, TexturesText>,
    pub(super) models: Vec<ModelText>,
    pub(super) spheres: Vec<Sphere>,
    pub(super) planes: Vec<Plane>,
    pub(super) triangles: Vec<Triangle>,
    /// What was accepted although it looks unintended.
    pub(super) warnings: Vec<Fault>,
}

/// What is gathered on the way through the text.
#[derive(Default)]
struct Reading {
    warnings: Vec<Fault>,
}

impl Reading {
    fn warn(&mut self, at: usize, message: String) {
        self.warnings.push(Fault { at, message });
    }
}

/// Reads a scene file's text.
///
/// # Errors
/// The fault that stands first in the text: no TOML, an unknown key, a value of the wrong type or out of range, an
/// unknown material, a feature that is not built yet.
pub(super) fn read(text: &str) -> Read<SceneText> {
    check_size(text)?;
    let document = DeTable::parse(text).map_err(|e| {
        let at = e.span().map_or(0, |span| span.start);
        let message = e.message().trim().replace('\n', ", ");
        let hint = if has_escape(text, at) { format!("; {}", value::ESCAPES) } else { String::new() };
        Fault { at, message: format!("not valid TOML: {message}{hint}") }
    })?;
    let top = Table::of("the scene file", 0, document.get_ref(), KEYS)?;
    let mut first = FirstFault::default();
    let scene = read_sections(top, &mut first);
    first.into_result()?;
    // Without a fault every section has been read.
    scene.ok_or_else(|| top.fault("the scene file cannot be read"))
}

/// Whether the line at an offset has a back slash in double quotes up to there, or just behind.
fn has_escape(text: &str, at: usize) -> bool {
    let start = text.get(..at).and_then(|before| before.rfind('\n')).map_or(0, |end| end + 1);
    let line = text.get(start..).and_then(|rest| rest.lines().next()).unwrap_or_default();
    let mut quote = None;
    line.chars().any(|c| {
        match quote {
            None if matches!(c, '"' | '\'') => quote = Some(c),
            Some(open) if open == c => quote = None,
            _ => {}
        }
        c == '\\' && quote == Some('"')
    })
}

/// Values of a scene file, tables and lists included. The parsed text takes some hundred bytes for each.
const MAX_VALUES: usize = 1 << 24;

/// Refuses a text whose parsed form would take far more memory than the text: 60 MB of `{}` take gigabytes. Every value
/// but the first comes after one of these characters; those in strings and comments are counted as well.
fn check_size(text: &str) -> Read<()> {
    let begins_value = |byte: u8| matches!(byte, b'=' | b',' | b'[' | b'{');
    let mut places = text.bytes().enumerate().filter(|(_, byte)| begins_value(*byte)).map(|(at, _)| at);
    match places.nth(MAX_VALUES) {
        Some(at) => Err(Fault {
            at,
            message: format!(
                "more than {MAX_VALUES} values in a scene file; write meshes as models (`.obj`) and name them here"
            ),
        }),
        None => Ok(()),
    }
}

/// Reads every section, so that the first fault of them all can be told; `None` when there was one.
fn read_sections(top: Table<'_>, first: &mut FirstFault) -> Option<SceneText> {
    let mut reading = Reading::default();
    let reading = &mut reading;
    let ambient = first.keep(top.read("ambient", |value| value.color(MAX_LIGHT)));
    let render = section(top, "render", "[render]", &view::render_keys(), view::render, first);
    let camera = |table: Table<'_>| view::camera(table, reading);
    let camera = section(top, "camera", "[camera]", view::CAMERA_KEYS, camera, first);
    let background =
        section(top, "background", "[background]", view::BACKGROUND_KEYS, view::background, first);
    let light = |table: Table<'_>| light::light(table, reading);
    let lights = list(top, "light", "[[light]]", (light::LIGHT_KEYS, MAX_LIGHTS), light, first);
    let mut materials = read_materials(top, first);
    let model = |table: Table<'_>| objects::model(table, &materials, reading);
    let models = list(top, "model", "[[model]]", (objects::MODEL_KEYS, MAX_MODELS), model, first);
    let sphere = |table: Table<'_>| objects::sphere(table, &mut materials);
    let spheres = list(top, "sphere", "[[sphere]]", (objects::SPHERE_KEYS, MAX_SPHERES), sphere, first);
    let plane = |table: Table<'_>| objects::plane(table, &mut materials);
    let planes = list(top, "plane", "[[plane]]", (objects::PLANE_KEYS, MAX_PLANES), plane, first);
    let triangle = |table: Table<'_>| objects::triangle(table, &mut materials, reading);
    let triangles =
        list(top, "triangle", "[[triangle]]", (objects::TRIANGLE_KEYS, MAX_TRIANGLES), triangle, first);
    reading.warnings.sort_by_key(|warning| warning.at);
    let (materials, textures) = materials.into_parts();
    Some(SceneText {
        ambient: ambient?.unwrap_or(Vec3::ZERO),
        render: render?.unwrap_or_default(),
        camera: camera?,
        background: background?.unwrap_or(Background::Color(Vec3::ZERO)),
        lights,
        materials,
        textures,
        models,
        spheres,
        planes,
        triangles: triangles.into_iter().flatten().collect(),
        warnings: std::mem::take(&mut reading.warnings),
    })
}

/// Reads a table that may be absent; the outer `None` means a fault.
fn section<'t, T>(
    top: Table<'t>,
    key: &'static str,
    name: &'t str,
    known: &[&str],
    read: impl FnOnce(Table<'t>) -> Read<T>,
    first: &mut FirstFault,
) -> Option<Option<T>> {
    first.keep(top.read(key, |value| read(Table::open(name, value.value, known)?)))
}

/// Reads each table of a list, of which there may be `most`; those with a fault are missing from the result.
fn list<'t, T>(
    top: Table<'t>,
    key: &'static str,
    name: &'t str,
    (known, most): (&[&str], usize),
    mut read: impl FnMut(Table<'t>) -> Read<T>,
    first: &mut FirstFault,
) -> Vec<T> {
    let tables =
        first.keep(tables_of(top.get(key)).and_then(|tables| within(tables, name, most))).unwrap_or_default();
    tables
        .into_iter()
        .filter_map(|value| first.keep(Table::open(name, value, known).and_then(&mut read)))
        .collect()
}

/// Refuses a list that is too long, before any of it is built.
fn within<'t>(
    tables: Vec<&'t Spanned<DeValue<'t>>>,
    name: &str,
    most: usize,
) -> Read<Vec<&'t Spanned<DeValue<'t>>>> {
    match tables.get(most) {
        Some(first_beyond) => {
            let count = tables.len();
            Err(Fault::at_value(first_beyond, format!("{count} times {name}, at most {most} are allowed")))
        }
        None => Ok(tables),
    }
}

/// All names are known before a value is read, so that a fault in one material hides none in its users.
fn read_materials(top: Table<'_>, first: &mut FirstFault) -> Materials {
    let Some(value) = top.get("material") else { return Materials::default() };
    let Some(entries) = first.keep(material_tables(value)) else { return Materials::default() };
    let mut materials = Materials::named(entries.iter().map(|(name, _)| name.to_string()).collect());
    for (index, (name, value)) in entries.into_iter().enumerate() {
        let name = format!("[material.{}]", fault::shortened(name));
        let read = || material::material(Table::open(&name, value, material::MATERIAL_KEYS)?);
        if let Some(material) = first.keep(read()) {
            materials.define(index, material);
        }
    }
    materials
}

fn material_tables<'t>(value: Value<'t>) -> Read<Vec<(&'t str, &'t Spanned<DeValue<'t>>)>> {
    match value.value.get_ref() {
        DeValue::Table(entries) if entries.len() > MAX_MATERIALS => {
            let count = entries.len();
            Err(value.fault(format!("{count} materials, at most {MAX_MATERIALS} are allowed")))
        }
        DeValue::Table(entries) => {
            Ok(entries.iter().map(|(name, value)| (name.get_ref().as_ref(), value)).collect())
        }
        _ => Err(value.fault("materials are tables with a name: write [material.NAME]")),
    }
}
