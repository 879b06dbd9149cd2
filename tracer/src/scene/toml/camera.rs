//! The table `[camera]`.

use glam::DVec3;

use super::Reading;
use super::fault::Read;
use super::knobs;
use super::shutter::{Shutter, shutter};
use super::table::Table;
use super::value::Value;
use crate::rotation;
use crate::scene::data::{CameraKind, FovAxis, Integrator, Lens};
use crate::scene::validate::{MAX_COORDINATE, view_fault};

pub(super) const CAMERA_KEYS: &[&str] = &[
    "kind",
    "position",
    "look_at",
    "direction",
    "rotation",
    "up",
    "fov",
    "fov_axis",
    "view_height",
    "zoom",
    "aperture",
    "focus_distance",
    "shutter",
];

/// Default field of view of a pinhole camera in degrees.
const PINHOLE_FOV: f64 = 40.0;
/// Default field of view of a fisheye camera in degrees: half of the surroundings.
const FISHEYE_FOV: f64 = 180.0;
/// Default height of an orthographic camera's picture in world units.
const VIEW_HEIGHT: f64 = 2.0;

/// A camera of the file. Its aim may be a direction: the point is chosen once the scene's bounds are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraText {
    /// Projection of points to the picture.
    pub(crate) kind: CameraKind,
    /// World position.
    pub(crate) position: DVec3,
    /// Viewing direction.
    pub(crate) aim: Aim,
    /// Up direction in the picture.
    pub(crate) up: DVec3,
    /// Field of view in degrees.
    pub(crate) fov: f64,
    /// Divides the view plane's size.
    pub(crate) zoom: f64,
    /// Its lens.
    pub(crate) lens: Lens,
    /// When its shutter is open.
    pub(in crate::scene::toml) shutter: Shutter,
}

/// Viewing direction of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Aim {
    /// Towards a point.
    Point(DVec3),
    /// Along a unit vector.
    Direction(DVec3),
}

#[derive(Clone, Copy)]
enum Kind {
    Pinhole,
    Orthographic,
    Fisheye,
}

impl Kind {
    const WORDS: [(&'static str, Self); 3] =
        [("pinhole", Self::Pinhole), ("orthographic", Self::Orthographic), ("fisheye", Self::Fisheye)];

    /// The name in messages, and the keys without effect.
    fn idle_keys(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Pinhole => ("a pinhole camera", &["view_height"]),
            Self::Orthographic => {
                ("an orthographic camera", &["fov", "fov_axis", "aperture", "focus_distance"])
            }
            Self::Fisheye => {
                ("a fisheye camera", &["fov_axis", "view_height", "zoom", "aperture", "focus_distance"])
            }
        }
    }
}

/// Reads the camera of a scene that is rendered by `integrator`.
pub(super) fn camera(table: Table<'_>, integrator: &Integrator, reading: &mut Reading) -> Read<CameraText> {
    let word = table.read("kind", |kind| kind.word(&Kind::WORDS))?.unwrap_or(Kind::Pinhole);
    let position = table.required("position")?.vector()?;
    let up = table.read("up", |value| value.direction())?.unwrap_or(DVec3::Y);
    let aim = table
        .one_of(&["look_at", "direction", "rotation"])?
        .ok_or_else(|| table.fault("`look_at` is missing in [camera] (or `direction`, or `rotation`)"))?;
    let (looks, up) = aim_and_up(aim, up)?;
    check_view(aim, position, looks, up)?;
    let (kind, fov) = projection(table, word)?;
    let zoom = table.read("zoom", |value| value.positive())?.unwrap_or(1.0);
    let (name, idle) = word.idle_keys();
    idle.iter().for_each(|key| reading.idle(table, key, &format!("on {name}")));
    let lens = lens(table)?;
    if let Kind::Pinhole = word {
        warn_about_lens(table, &lens, integrator, reading);
    }
    let shutter = shutter(table)?;
    Ok(CameraText { kind, position, aim: looks, up, fov, zoom, lens, shutter })
}

fn lens(table: Table<'_>) -> Read<Lens> {
    let aperture =
        |value: Value<'_>| value.number("from 0 to 1e30", |radius| (0.0..=MAX_COORDINATE).contains(&radius));
    Ok(Lens {
        aperture: table.read("aperture", aperture)?.unwrap_or(0.0),
        focus_distance: table.read("focus_distance", |value| value.positive())?,
    })
}

/// Warns about keys of the lens of a pinhole camera that change nothing.
fn warn_about_lens(table: Table<'_>, lens: &Lens, integrator: &Integrator, reading: &mut Reading) {
    if *integrator == Integrator::Direct {
        for key in ["aperture", "focus_distance"] {
            reading.idle(table, key, knobs::with(integrator));
        }
    } else if lens.aperture == 0.0 {
        reading.idle(table, "focus_distance", "without an `aperture`");
    }
}

/// The kind of camera with its own keys, and the field of view.
fn projection(table: Table<'_>, kind: Kind) -> Read<(CameraKind, f64)> {
    let fov = table.read("fov", |value| match kind {
        Kind::Pinhole => value.number("above 0 and below 180 degrees", |n| n > 0.0 && n < 180.0),
        _ => value.number("above 0 and at most 360 degrees", |n| n > 0.0 && n <= 360.0),
    })?;
    let fov_axis = table.read("fov_axis", |value| value.word(&FovAxis::WORDS))?;
    let view_height = table.read("view_height", |value| value.positive())?;
    Ok(match kind {
        Kind::Pinhole => {
            let fov_axis = fov_axis.unwrap_or(FovAxis::Vertical);
            (CameraKind::Pinhole { fov_axis }, fov.unwrap_or(PINHOLE_FOV))
        }
        Kind::Orthographic => {
            let view_height = view_height.unwrap_or(VIEW_HEIGHT);
            (CameraKind::Orthographic { view_height }, PINHOLE_FOV)
        }
        Kind::Fisheye => (CameraKind::Fisheye, fov.unwrap_or(FISHEYE_FOV)),
    })
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
