//! The scene file: TOML to plain data with positions for messages. No other file is opened here.
//!
//! The text is parsed into tables whose values have positions, and each table is read with the list of its keys. So
//! every unknown key is a fault, and every fault has a line and a column.

mod background;
mod camera;
mod fault;
mod groups;
mod keys;
mod knobs;
mod light;
mod material;
mod objects;
mod section;
mod shutter;
mod table;
mod value;
mod view;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use fault::{FirstFault, Read};
use groups::{Objects, with_name};
use material::Materials;
use section::{list, section};
use shutter::Shutter;
use table::Table;
use value::Value;

use crate::material::Material;
use crate::scene::animation::CameraPath;
use crate::scene::data::{Disk, Integrator, Light, Motion, Plane, RenderSettings, Sphere, Triangle};
use crate::scene::validate::{
    MAX_DISKS, MAX_LIGHT, MAX_LIGHTS, MAX_MATERIALS, MAX_MODELS, MAX_PLANES, MAX_SPHERES, MAX_TRIANGLES,
    MAX_VOLUMES,
};

pub(super) use background::{BackgroundText, PictureText, RadianceText, SkyPictureText};
pub(super) use camera::{Aim, CameraText};
pub(super) use fault::{Fault, place};
pub(super) use material::{TextureText, TexturesText};
pub(super) use objects::{BoundaryText, ModelText, VolumeText};

const KEYS: &[&str] = &[
    "ambient",
    "render",
    "camera",
    "camera_key",
    "background",
    "light",
    "material",
    "model",
    "sphere",
    "plane",
    "disk",
    "triangle",
    "rectangle",
    "box",
    "group",
    "volume",
];

/// Number of triangles of a rectangle and of a box.
const RECTANGLE_TRIANGLES: usize = 2;
const BOX_TRIANGLES: usize = 12;

/// The content of a scene file. Models are not loaded; what the file leaves open is left to the loader.
#[derive(Clone, Debug)]
pub(super) struct SceneText {
    /// I_a; zero if absent.
    pub(super) ambient: Vec3,
    pub(super) render: RenderSettings,
    pub(super) camera: Option<CameraText>,
    /// Background; black if absent.
    pub(super) background: BackgroundText,
    pub(super) lights: Vec<Light>,
    pub(super) materials: Vec<Material>,
    /// Textures by the index of their material.
    pub(super) textures: BTreeMap<u32, TexturesText>,
    pub(super) models: Vec<ModelText>,
    pub(super) spheres: Vec<Sphere>,
    pub(super) planes: Vec<Plane>,
    pub(super) disks: Vec<Disk>,
    /// Single triangles, then those of rectangles and boxes.
    pub(super) triangles: Vec<Triangle>,
    pub(super) volumes: Vec<VolumeText>,
    /// Objects that move while the shutter is open; models have the indices of `models`.
    pub(super) motions: Vec<Motion>,
    /// Path of the camera over frames.
    pub(super) camera_path: CameraPath,
    /// Whether an object, a group or a light has keys.
    pub(super) moves: bool,
    /// Time of the last key, in seconds; 0 without keys.
    pub(super) last_key: f64,
    /// Accepted input that is probably a mistake.
    pub(super) warnings: Vec<Fault>,
}

/// Collects warnings while the text is read.
#[derive(Default)]
struct Reading {
    warnings: Vec<Fault>,
    /// Messages about keys without an effect, each reported once.
    idle: BTreeSet<String>,
    shutter: Shutter,
    /// Whether a table has a pose at time 1.
    has_ends: bool,
    /// Time at which objects with keys are read, in seconds.
    time: f64,
    /// Time of the last key so far, in seconds.
    last_key: f64,
    /// Whether an object, a group or a light has keys.
    moves: bool,
}

impl Reading {
    fn warn(&mut self, at: usize, message: String) {
        self.warnings.push(Fault { at, message });
    }

    /// Warns about a key, if the table has it: "`ior` in [material.a] has no effect" with a reason. Further tables with
    /// the same message are not reported.
    fn idle(&mut self, table: Table<'_>, key: &'static str, reason: &str) {
        let Some(value) = table.get(key) else { return };
        let message = format!("{value} has no effect {reason}");
        if self.idle.insert(message.clone()) {
            self.warn(value.start(), message);
        }
    }
}

/// Reads a scene file's text. Objects with keys are as they are at a time, in seconds.
///
/// # Errors
/// The first fault in the text: no TOML, an unknown key, a value of the wrong type or out of range, an unknown
/// material, an unsupported feature.
pub(super) fn read(text: &str, time: f64) -> Read<SceneText> {
    check_size(text)?;
    let document = DeTable::parse(text).map_err(|e| {
        let at = e.span().map_or(0, |span| span.start);
        let message = e.message().trim().replace('\n', ", ");
        let hint = if has_escape(text, at) { format!("; {}", value::ESCAPES) } else { String::new() };
        Fault { at, message: format!("not valid TOML: {message}{hint}") }
    })?;
    let top = Table::of("the scene file", 0, document.get_ref(), KEYS)?;
    let mut first = FirstFault::default();
    let scene = read_sections(top, time, &mut first);
    first.into_result()?;
    // Without a fault every section has been read.
    scene.ok_or_else(|| top.fault("the scene file cannot be read"))
}

/// Whether the line at an offset has a back slash in double quotes, before the offset or just behind.
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

/// Largest number of values of a scene file, including tables and lists. Each takes some hundred bytes when parsed.
const MAX_VALUES: usize = 1 << 24;

/// Refuses a text whose parsed form would take far more memory than the text: 60 MB of `{}` take gigabytes. Every
/// value except the first follows one of these characters; those in strings and comments are counted as well.
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

/// Reads all sections, so that the first fault in the text is found; `None` if there is one.
fn read_sections(top: Table<'_>, time: f64, first: &mut FirstFault) -> Option<SceneText> {
    let mut reading = Reading { time, ..Reading::default() };
    let reading = &mut reading;
    let ambient = first.keep(top.read("ambient", |value| value.color(MAX_LIGHT)));
    let render = |table: Table<'_>| view::render(table, reading);
    let render = section(top, "render", "[render]", &view::render_keys(), render, first);
    let integrator = &render.flatten().unwrap_or_default().integrator;
    if integrator.path().is_some() {
        reading.idle(top, "ambient", knobs::with(integrator));
    }
    let camera = |table: Table<'_>| camera::camera(table, integrator, reading);
    let camera = section(top, "camera", "[camera]", camera::CAMERA_KEYS, camera, first);
    reading.shutter = camera.flatten().map_or(Shutter::default(), |camera| camera.shutter);
    let kind = camera.flatten().map(|camera| camera.kind);
    let camera_path = first.keep(keys::camera_path(top, kind, reading));
    let background = |table: Table<'_>| background::background(table, reading);
    let background =
        section(top, "background", "[background]", background::BACKGROUND_KEYS, background, first);
    let light = |table: Table<'_>| light::light(table, integrator, reading);
    let lights = list(top, "light", "[[light]]", (light::LIGHT_KEYS, MAX_LIGHTS), light, first);
    let mut materials = read_materials(top, integrator, reading, first);
    let plane = |table: Table<'_>| objects::plane(table, &mut materials, reading);
    let planes = list(top, "plane", "[[plane]]", (objects::PLANE_KEYS, MAX_PLANES), plane, first);
    if *integrator == Integrator::Direct {
        reading.idle(top, "volume", knobs::with(integrator));
    }
    let volume = |table: Table<'_>| objects::volume(table, reading);
    let volumes = list(top, "volume", "[[volume]]", (objects::VOLUME_KEYS, MAX_VOLUMES), volume, first);
    let objects = read_objects(top, &mut materials, reading, first);
    let motions = objects.motions();
    reading.check_shutter(integrator, !motions.is_empty());
    reading.warnings.sort_by_key(|warning| warning.at);
    let (materials, textures) = materials.into_parts();
    Some(SceneText {
        ambient: ambient?.unwrap_or(Vec3::ZERO),
        render: render?.unwrap_or_default(),
        camera: camera?,
        background: background?.unwrap_or_default(),
        lights,
        materials,
        textures,
        models: objects.models,
        spheres: objects.spheres,
        planes,
        disks: objects.disks,
        triangles: objects.triangles,
        volumes,
        motions,
        camera_path: camera_path?,
        moves: reading.moves,
        last_key: reading.last_key,
        warnings: std::mem::take(&mut reading.warnings),
    })
}

/// Reads the objects that may have names, and places those in groups.
fn read_objects(
    top: Table<'_>,
    materials: &mut Materials,
    reading: &mut Reading,
    first: &mut FirstFault,
) -> Objects {
    let mut objects = Objects::default();
    let model = |table: Table<'_>| with_name(table, objects::model(table, materials, reading)?);
    let models = (objects::MODEL_KEYS, MAX_MODELS);
    objects.add_models(list(top, "model", "[[model]]", models, model, first));
    let sphere = |table: Table<'_>| with_name(table, objects::sphere(table, materials, reading)?);
    let spheres = (objects::SPHERE_KEYS, MAX_SPHERES);
    objects.add_spheres(list(top, "sphere", "[[sphere]]", spheres, sphere, first));
    let disk = |table: Table<'_>| with_name(table, objects::disk(table, materials)?);
    let disks = (objects::DISK_KEYS, MAX_DISKS);
    objects.add_disks(list(top, "disk", "[[disk]]", disks, disk, first));
    let triangle = |table: Table<'_>| with_name(table, objects::triangle(table, materials, reading)?);
    let triangles = (objects::TRIANGLE_KEYS, MAX_TRIANGLES);
    objects.add_triangles(list(top, "triangle", "[[triangle]]", triangles, triangle, first));
    let rectangle = |table: Table<'_>| with_name(table, objects::rectangle(table, materials)?);
    let rectangles = (objects::RECTANGLE_KEYS, MAX_TRIANGLES / RECTANGLE_TRIANGLES);
    objects.add_triangles(list(top, "rectangle", "[[rectangle]]", rectangles, rectangle, first));
    let cuboid = |table: Table<'_>| with_name(table, objects::cuboid(table, materials)?);
    let boxes = (objects::BOX_KEYS, MAX_TRIANGLES / BOX_TRIANGLES);
    objects.add_triangles(list(top, "box", "[[box]]", boxes, cuboid, first));
    let group = |table: Table<'_>| with_name(table, groups::group(table, reading)?);
    let groups = (groups::GROUP_KEYS, groups::MAX_GROUPS);
    let groups = list(top, "group", "[[group]]", groups, group, first);
    // With another fault a child may seem unknown.
    if first.is_none() {
        first.keep(objects.place(groups, materials));
    }
    objects
}

/// Reads all materials. All names are collected first, so that a fault in one material hides none in its users.
fn read_materials(
    top: Table<'_>,
    integrator: &Integrator,
    reading: &mut Reading,
    first: &mut FirstFault,
) -> Materials {
    let Some(value) = top.get("material") else { return Materials::default() };
    let Some(entries) = first.keep(material_tables(value)) else { return Materials::default() };
    let mut materials = Materials::named(entries.iter().map(|(name, _)| name.to_string()).collect());
    let mut patterns = Vec::new();
    for (index, (name, value)) in entries.into_iter().enumerate() {
        let name = format!("[material.{}]", fault::shortened(name));
        let read = Table::open(&name, value, material::MATERIAL_KEYS)
            .and_then(|table| material::material(table, integrator, reading));
        if let Some(mut text) = first.keep(read) {
            patterns.extend(text.checker.take().map(|pattern| (index, pattern)));
            materials.define(index, text);
        }
    }
    // The colours of patterns may be those of materials further down.
    let patterns: Vec<_> =
        patterns.iter().map(|(index, pattern)| (*index, pattern.resolved(&materials))).collect();
    for (index, pattern) in patterns {
        if let Some(checker) = first.keep(pattern) {
            materials.set_checker(index, checker);
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
