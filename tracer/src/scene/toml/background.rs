//! The table `[background]`.

use std::path::PathBuf;

use glam::Vec3;

use super::Reading;
use super::fault::{Fault, Read};
use super::table::Table;
use super::value::Value;
use crate::scene::data::Background;
use crate::scene::validate::MAX_LIGHT;

pub(super) const BACKGROUND_KEYS: &[&str] =
    &["color", "gradient", "cubemap", "panorama", "rotate", "strength", "visible"];

/// Keys of which a background has exactly one.
const KINDS: &[&str] = &["color", "gradient", "cubemap", "panorama"];

/// Number of faces of a cube map.
const FACES: usize = 6;

/// A background whose pictures have not been loaded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BackgroundText {
    pub(crate) radiance: RadianceText,
    /// Whether rays of the camera see it.
    pub(crate) visible: bool,
}

/// Radiance of rays that hit nothing.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum RadianceText {
    /// Colours, with the strength as a factor.
    Plain(Background),
    /// Pictures.
    Sky(SkyText),
}

/// A sky whose pictures have not been loaded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SkyText {
    pub(crate) picture: SkyPictureText,
    /// Degrees about +Y.
    pub(crate) rotate: f64,
    pub(crate) strength: f32,
}

/// The picture files of a sky.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum SkyPictureText {
    Panorama(PictureText),
    /// The faces +X, -X, +Y, -Y, +Z, -Z.
    Cubemap([PictureText; FACES]),
}

/// The name of a picture file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PictureText {
    /// As the scene file names it, relative to that file.
    pub(crate) file: PathBuf,
    /// Offset of the file's name in the text, for messages.
    pub(crate) at: usize,
}

impl Default for BackgroundText {
    /// Black.
    fn default() -> Self {
        Self { radiance: RadianceText::Plain(Background::Color(Vec3::ZERO)), visible: true }
    }
}

pub(super) fn background(table: Table<'_>, reading: &mut Reading) -> Read<BackgroundText> {
    let given = table.one_of(KINDS)?.ok_or_else(|| {
        table.fault("`color` is missing in [background] (or `gradient`, `cubemap` or `panorama`)")
    })?;
    let in_range = |n: f64| (0.0..=f64::from(MAX_LIGHT)).contains(&n);
    let strength = table.read("strength", |value| value.number("from 0 to 1e30", in_range))?;
    let strength = strength.unwrap_or(1.0) as f32;
    let rotate = table.read("rotate", |value| value.coordinate())?.unwrap_or(0.0);
    let visible = table.read("visible", |value| value.boolean())?.unwrap_or(true);
    let sky = |picture| RadianceText::Sky(SkyText { picture, rotate, strength });
    let radiance = match given.name {
        "color" => RadianceText::Plain(Background::Color(given.color(1.0)? * strength)),
        "gradient" => RadianceText::Plain(gradient(given, strength)?),
        "panorama" => sky(SkyPictureText::Panorama(picture(&given)?)),
        _ => sky(SkyPictureText::Cubemap(cubemap(given)?)),
    };
    if matches!(radiance, RadianceText::Plain(_)) {
        reading.idle(table, "rotate", "on a background without a picture");
    }
    Ok(BackgroundText { radiance, visible })
}

fn gradient(value: Value<'_>, strength: f32) -> Read<Background> {
    let table = Table::open("`gradient` in [background]", value.value, &["bottom", "top"])?;
    let color = |key| -> Result<Vec3, Fault> { Ok(table.required(key)?.color(1.0)? * strength) };
    Ok(Background::Gradient { bottom: color("bottom")?, top: color("top")? })
}

fn cubemap(value: Value<'_>) -> Read<[PictureText; FACES]> {
    let expected = "an array of six picture files: +x, -x, +y, -y, +z, -z";
    let faces = value.array::<FACES>(expected)?.iter().map(picture).collect::<Read<Vec<_>>>()?;
    <[PictureText; FACES]>::try_from(faces).map_err(|_| value.must_be(expected))
}

fn picture(value: &Value<'_>) -> Read<PictureText> {
    let file = PathBuf::from(value.file_name("the name of a picture file")?);
    Ok(PictureText { file, at: value.start() })
}
