//! The tables `[[volume]]`.

use std::path::PathBuf;

use glam::{DMat3, Vec3};

use super::super::Reading;
use super::super::fault::Read;
use super::super::keys::Keys;
use super::super::table::Table;
use super::super::value::Value;
use super::model::{ModelText, placement};
use crate::scene::data::{NormalMode, VolumeBoundary};
use crate::scene::validate::MAX_COORDINATE;

pub(in crate::scene::toml) const VOLUME_KEYS: &[&str] =
    &["sphere", "box", "model", "density", "color", "translate", "rotate", "scale", "up"];

/// Keys that place a model.
const PLACEMENT_KEYS: [&str; 4] = ["translate", "rotate", "scale", "up"];

/// A volume whose model has not been loaded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VolumeText {
    pub(crate) boundary: BoundaryText,
    /// Mean number of scatterings per world unit.
    pub(crate) density: f64,
    /// Albedo.
    pub(crate) color: Vec3,
}

/// The surface of a volume whose model has not been loaded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum BoundaryText {
    /// A sphere or a box.
    Whole(VolumeBoundary),
    Model(Box<ModelText>),
}

impl VolumeText {
    /// The model that bounds it, if one does.
    pub(crate) fn model(&self) -> Option<&ModelText> {
        match &self.boundary {
            BoundaryText::Whole(_) => None,
            BoundaryText::Model(model) => Some(model),
        }
    }
}

pub(in crate::scene::toml) fn volume(table: Table<'_>, reading: &mut Reading) -> Read<VolumeText> {
    let boundary = table
        .one_of(&["sphere", "box", "model"])?
        .ok_or_else(|| table.fault("`sphere` is missing in [[volume]] (or `box`, or `model`)"))?;
    let boundary = match boundary.name {
        "sphere" => BoundaryText::Whole(sphere(boundary)?),
        "box" => BoundaryText::Whole(cuboid(boundary)?),
        _ => BoundaryText::Model(Box::new(model(table, boundary, reading)?)),
    };
    if let BoundaryText::Whole(_) = boundary {
        PLACEMENT_KEYS.iter().for_each(|key| reading.idle(table, key, "without a `model`"));
    }
    let density = |value: Value<'_>| {
        value.number("from 0 to 1e30", |density| (0.0..=MAX_COORDINATE).contains(&density))
    };
    Ok(VolumeText {
        boundary,
        density: table.read("density", density)?.unwrap_or(1.0),
        color: table.read("color", |value| value.color(1.0))?.unwrap_or(Vec3::splat(0.9)),
    })
}

fn sphere(value: Value<'_>) -> Read<VolumeBoundary> {
    let table = Table::open("`sphere` in [[volume]]", value.value, &["center", "radius"])?;
    let center = table.required("center")?.vector()?;
    Ok(VolumeBoundary::Sphere { center, radius: table.required("radius")?.positive()? })
}

fn cuboid(value: Value<'_>) -> Read<VolumeBoundary> {
    let table = Table::open("`box` in [[volume]]", value.value, &["min", "max"])?;
    let lower = table.required("min")?.vector()?;
    let max = table.required("max")?;
    let upper = max.vector()?;
    if lower.cmplt(upper).all() {
        Ok(VolumeBoundary::Box { lower, upper })
    } else {
        Err(max.must_be("above `min` on every axis"))
    }
}

fn model(table: Table<'_>, file: Value<'_>, reading: &mut Reading) -> Read<ModelText> {
    let name = file.file_name("the name of a model file")?;
    let [translate, rotate, scale] = placement(table, &Keys::NONE, reading)?;
    Ok(ModelText {
        file: PathBuf::from(name),
        at: file.start(),
        material: Some(0),
        material_at: 0,
        normals: NormalMode::Flat,
        crease_angle: None,
        translate,
        rotate,
        scale,
        group: DMat3::IDENTITY,
        closing: None,
    })
}
