//! The tables `[[model]]`.

use std::path::PathBuf;

use glam::{DMat3, DVec3};

use super::super::Reading;
use super::super::fault::Read;
use super::super::keys::{Keys, POSE_KEYS};
use super::super::material::Materials;
use super::super::table::Table;
use crate::scene::data::NormalMode;
use crate::scene::import::Up;

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
    "key",
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
    let keys = Keys::of(table, "[[model.key]]", POSE_KEYS, reading)?;
    keys.contradict(table, &["translate_end", "rotate_end"])?;
    let [translate, rotate, scale] = placement(table, &keys, reading)?;
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
pub(super) fn placement<'t>(table: Table<'t>, keys: &Keys<'t>, reading: &mut Reading) -> Read<[DVec3; 3]> {
    let rotate = keys.vector_or(table, "rotate", reading)?.unwrap_or(DVec3::ZERO);
    let scale = keys.scale_or(table, reading)?.unwrap_or(DVec3::ONE);
    let up = table.read("up", |value| value.word(&Up::WORDS))?.unwrap_or_default();
    let (rotate, scale) = up.before(rotate, scale);
    let translate = keys.vector_or(table, "translate", reading)?.unwrap_or(DVec3::ZERO);
    Ok([translate, rotate, scale])
}
