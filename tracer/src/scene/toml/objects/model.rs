//! The tables `[[model]]`.

use std::path::PathBuf;

use glam::{DMat3, DVec3};

use super::super::Reading;
use super::super::fault::Read;
use super::super::material::Materials;
use super::super::table::Table;
use super::super::value::Value;
use crate::scene::data::NormalMode;
use crate::scene::import::Up;
use crate::scene::validate::MAX_COORDINATE;

pub(in crate::scene::toml) const MODEL_KEYS: &[&str] = &[
    "name",
    "file",
    "material",
    "normals",
    "translate",
    "rotate",
    "scale",
    "up",
    "crease_angle",
    "translate_end",
    "rotate_end",
];

/// A model whose file has not been loaded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ModelText {
    /// As the scene file names it, relative to that file.
    pub(crate) file: PathBuf,
    /// Offset of the file's name in the text, for messages.
    pub(crate) at: usize,
    /// Index of the material that replaces the model's own; `None` keeps them.
    pub(crate) material: Option<u32>,
    /// Offset of that material's name in the text.
    pub(crate) material_at: usize,
    pub(crate) normals: NormalMode,
    /// Crease angle in degrees, and the offset of its value in the text.
    pub(crate) crease_angle: Option<(f64, usize)>,
    /// World position of the file's origin, after the transforms of its groups.
    pub(crate) translate: DVec3,
    /// Rotation in degrees, including the one that rotates the file upright.
    pub(crate) rotate: DVec3,
    /// Scale along the axes of the file.
    pub(crate) scale: DVec3,
    /// Linear part of the transforms of its groups.
    pub(crate) group: DMat3,
    /// `translate` and `rotate` when the shutter closes, if they are other ones.
    pub(in crate::scene::toml) closing: Option<[DVec3; 2]>,
}

pub(in crate::scene::toml) fn model(
    table: Table<'_>,
    materials: &Materials,
    reading: &mut Reading,
) -> Read<ModelText> {
    let file = table.required("file")?;
    let name = file.file_name("the name of a model file")?;
    let modes = [("smooth", NormalMode::Smooth), ("flat", NormalMode::Flat)];
    let normals = table.read("normals", |value| value.word(&modes))?.unwrap_or(NormalMode::Smooth);
    let crease_angle = table.read("crease_angle", |value| {
        Ok((value.number("of degrees from 0 to 180", |n| (0.0..=180.0).contains(&n))?, value.start()))
    })?;
    if let (Some((_, at)), NormalMode::Flat) = (crease_angle, normals) {
        let message = "`crease_angle` in [[model]] has no effect where `normals` is \"flat\"".to_owned();
        reading.warn(at, message);
    }
    let [translate, rotate, scale] = placement(table)?;
    for key in ["translate_end", "rotate_end"] {
        reading.note_end(table, key);
    }
    let up = table.read("up", |value| value.word(&Up::WORDS))?.unwrap_or_default();
    let rotate_end = table.read("rotate_end", |value| value.vector())?;
    let translate = reading.shutter.ends(translate, table.read("translate_end", |value| value.vector())?);
    let rotate = reading.shutter.ends(rotate, rotate_end.map(|degrees| up.before(degrees, scale).0));
    let moves = translate.opening != translate.closing || rotate.opening != rotate.closing;
    let closing = moves.then_some([translate.closing, rotate.closing]);
    let (translate, rotate) = (translate.opening, rotate.opening);
    Ok(ModelText {
        file: PathBuf::from(name),
        at: file.start(),
        material: materials.referred(table)?,
        material_at: table.get("material").map_or(0, |value| value.start()),
        normals,
        crease_angle,
        translate,
        rotate,
        scale,
        group: DMat3::IDENTITY,
        closing,
    })
}

/// Translation, rotation and scale of a file.
pub(super) fn placement(table: Table<'_>) -> Read<[DVec3; 3]> {
    let rotate = table.read("rotate", |value| value.vector())?.unwrap_or(DVec3::ZERO);
    let scale = table.read("scale", scale)?.unwrap_or(DVec3::ONE);
    let up = table.read("up", |value| value.word(&Up::WORDS))?.unwrap_or_default();
    let (rotate, scale) = up.before(rotate, scale);
    let translate = table.read("translate", |value| value.vector())?.unwrap_or(DVec3::ZERO);
    Ok([translate, rotate, scale])
}

/// Factors along three axes, none of them zero.
pub(in crate::scene::toml) fn scale(value: Value<'_>) -> Read<DVec3> {
    let expected = "one number, or three in an array, none of them 0";
    let scale = if value.value.get_ref().is_array() {
        value.vector()?
    } else {
        let fits = |n: f64| n.abs() <= MAX_COORDINATE;
        DVec3::splat(value.number("(or an array of three), not 0 and up to 1e30", fits)?)
    };
    let flat = scale.to_array().contains(&0.0);
    if flat { Err(value.must_be(expected)) } else { Ok(scale) }
}
