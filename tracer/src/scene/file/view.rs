//! What is seen and how: `[render]`, `[camera]`, `[background]`.

use glam::{DVec3, Vec3};

use super::super::validate::{is_sample_count, view_fault};
use super::super::{Background, MAX_COORDINATE, MAX_DEPTH, RenderSettings, rotation};
use super::Reading;
use super::fault::{Fault, Read};
use super::knobs::{quality, scale};
use super::table::Table;
use super::value::Value;
use crate::image::MAX_SIDE;

pub(super) const RENDER_KEYS: &[&str] = &[
    "width",
    "height",
    "samples",
    "adaptive",
    "max_depth",
    "min_contribution",
    "shadows",
    "shading",
    "filter",
    "exponent",
    "pixels",
    "scale",
    "dither",
];
pub(super) const CAMERA_KEYS: &[&str] =
    &["kind", "position", "look_at", "direction", "rotation", "up", "fov", "view_height", "zoom"];
pub(super) const BACKGROUND_KEYS: &[&str] = &["color", "gradient", "cubemap", "panorama"];

/// A camera as the file gives it: where it looks is not yet a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraText {
    /// World position.
    pub(crate) position: DVec3,
    /// Where it looks.
    pub(crate) aim: Aim,
    /// Upwards in the picture.
    pub(crate) up: DVec3,
    /// Vertical field of view in degrees.
    pub(crate) fov: f64,
    /// Divides the view plane's size.
    pub(crate) zoom: f64,
}

/// Where a camera looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Aim {
    /// At a point.
    Point(DVec3),
    /// Along a unit vector.
    Direction(DVec3),
}

pub(super) fn render(table: Table<'_>) -> Read<RenderSettings> {
    let default = RenderSettings::default();
    let side = |value: Value<'_>| value.whole("of pixels from 1 to 16384", 1..=MAX_SIDE);
    let share = |value: Value<'_>| value.number("from 0 to 1", |n| (0.0..=1.0).contains(&n));
    let settings = RenderSettings {
        width: table.read("width", side)?.unwrap_or(default.width),
        height: table.read("height", side)?.unwrap_or(default.height),
        samples: table.read("samples", samples)?.unwrap_or(default.samples),
        max_depth: table
            .read("max_depth", |value| value.whole("from 0 to 64", 0..=MAX_DEPTH))?
            .unwrap_or(default.max_depth),
        min_contribution: table
            .read("min_contribution", share)?
            .map_or(default.min_contribution, |share| share as f32),
        quality: quality(table)?,
        scale: table.read("scale", scale)?.unwrap_or_default(),
    };
    let idle = settings.quality.adaptive && settings.samples == 1;
    table.read("adaptive", |value| if idle { Err(nothing_to_adapt(&value)) } else { Ok(()) })?;
    Ok(settings)
}

fn nothing_to_adapt(value: &Value<'_>) -> Fault {
    value.fault(
        "`adaptive = true` leaves out samples, but there is only one a pixel: set `samples` to 4, 9, 16, ...",
    )
}

fn samples(value: Value<'_>) -> Read<u32> {
    let expected = "that is a square from 1 to 256 (1, 4, 9, 16, ...)";
    let samples = value.whole(expected, 1..=u32::MAX)?;
    let square = is_sample_count(samples).then_some(samples);
    square.ok_or_else(|| value.must_be(&format!("a whole number {expected}")))
}

pub(super) fn camera(table: Table<'_>, reading: &mut Reading) -> Read<CameraText> {
    table.read("kind", |kind| {
        let other = kind.word(&[("pinhole", false), ("orthographic", true), ("fisheye", true)])?;
        let refusal = || kind.not_yet("this kind of camera", "use \"pinhole\"");
        if other { Err(refusal()) } else { Ok(()) }
    })?;
    table.read("view_height", |value| {
        value.number("above 0", is_positive)?;
        reading.warn(value.start(), format!("{value} has no effect on a pinhole camera"));
        Ok(())
    })?;
    let position = table.required("position")?.vector()?;
    let up = table.read("up", |value| value.direction())?.unwrap_or(DVec3::Y);
    let aim = table
        .one_of(&["look_at", "direction", "rotation"])?
        .ok_or_else(|| table.fault("`look_at` is missing in [camera] (or `direction`, or `rotation`)"))?;
    let (looks, up) = aim_and_up(aim, up)?;
    check_view(aim, position, looks, up)?;
    let fov = |value: Value<'_>| value.number("above 0 and below 180 degrees", |n| n > 0.0 && n < 180.0);
    Ok(CameraText {
        position,
        aim: looks,
        up,
        fov: table.read("fov", fov)?.unwrap_or(40.0),
        zoom: table.read("zoom", |value| value.number("above 0", is_positive))?.unwrap_or(1.0),
    })
}

fn is_positive(number: f64) -> bool {
    number > 0.0 && number <= MAX_COORDINATE
}

/// A rotation turns the whole camera, so it turns `up` as well; without one, `up` stands as it is written.
fn aim_and_up(aim: Value<'_>, up: DVec3) -> Read<(Aim, DVec3)> {
    match aim.name {
        "look_at" => Ok((Aim::Point(aim.vector()?), up)),
        "direction" => Ok((Aim::Direction(aim.direction()?), up)),
        _ => {
            let [pitch, yaw, roll] = aim.vector()?.to_array();
            let turned = rotation::of_camera(pitch, yaw, roll);
            Ok((Aim::Direction(turned * DVec3::NEG_Z), turned * up))
        }
    }
}

fn check_view(aim: Value<'_>, position: DVec3, looks: Aim, up: DVec3) -> Read<()> {
    let direction = match looks {
        Aim::Point(point) => point - position,
        Aim::Direction(direction) => direction,
    };
    let remedy = match looks {
        Aim::Direction(_) if aim.name == "rotation" => "; `rotation` turns `up` as well, so leave `up` out",
        _ => "",
    };
    let refuse = |fault| Err(aim.fault(format!("the camera must be {fault} ({aim}){remedy}")));
    view_fault(direction, up).map_or(Ok(()), refuse)
}

pub(super) fn background(table: Table<'_>) -> Read<Background> {
    let given = table
        .one_of(BACKGROUND_KEYS)?
        .ok_or_else(|| table.fault("`color` is missing in [background] (or `gradient`)"))?;
    match given.name {
        "color" => Ok(Background::Color(given.color(1.0)?)),
        "gradient" => gradient(given),
        _ => Err(given.not_yet("a background made of pictures", "use `color` or `gradient`")),
    }
}

fn gradient(value: Value<'_>) -> Read<Background> {
    let table = Table::open("`gradient` in [background]", value.value, &["bottom", "top"])?;
    let color = |key| -> Result<Vec3, Fault> { table.required(key)?.color(1.0) };
    Ok(Background::Gradient { bottom: color("bottom")?, top: color("top")? })
}
