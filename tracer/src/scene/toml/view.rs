//! The tables `[render]`, `[camera]` and `[background]`.

use glam::{DVec3, Vec3};

use super::Reading;
use super::fault::{Fault, Read};
use super::knobs;
use super::table::Table;
use super::value::Value;
use crate::image::MAX_SIDE;
use crate::rotation;
use crate::scene::data::{Background, RenderSettings};
use crate::scene::knobs::KNOBS;
use crate::scene::validate::{MAX_COORDINATE, view_fault};

/// Keys of `[render]` that are no knobs.
const SIZE_KEYS: [&str; 2] = ["width", "height"];

/// Keys of `[render]`.
pub(super) fn render_keys() -> Vec<&'static str> {
    let knobs = KNOBS.iter().map(|knob| knob.key);
    SIZE_KEYS.into_iter().chain(knobs).collect()
}

pub(super) const CAMERA_KEYS: &[&str] =
    &["kind", "position", "look_at", "direction", "rotation", "up", "fov", "view_height", "zoom"];
pub(super) const BACKGROUND_KEYS: &[&str] = &["color", "gradient", "cubemap", "panorama"];

/// A camera of the file. Its aim may be a direction: the point is chosen once the scene's bounds are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraText {
    /// World position.
    pub(crate) position: DVec3,
    /// Viewing direction.
    pub(crate) aim: Aim,
    /// Up direction in the picture.
    pub(crate) up: DVec3,
    /// Vertical field of view in degrees.
    pub(crate) fov: f64,
    /// Divides the view plane's size.
    pub(crate) zoom: f64,
}

/// Viewing direction of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Aim {
    /// Towards a point.
    Point(DVec3),
    /// Along a unit vector.
    Direction(DVec3),
}

pub(super) fn render(table: Table<'_>) -> Read<RenderSettings> {
    let default = RenderSettings::default();
    let side = |value: Value<'_>| value.whole("of pixels from 1 to 16384", 1..=MAX_SIDE);
    let settings = RenderSettings {
        width: table.read("width", side)?.unwrap_or(default.width),
        height: table.read("height", side)?.unwrap_or(default.height),
        ..default
    };
    let setting = knobs::setting(table, default.setting())?;
    Ok(settings.with_setting(setting))
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

/// Aim and up direction. A rotation applies to the whole camera, so to `up` as well.
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
