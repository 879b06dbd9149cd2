//! The tables `[[light]]`.

use glam::DVec3;

use super::Reading;
use super::fault::Read;
use super::knobs;
use super::table::Table;
use super::value::{Value, unit};
use crate::scene::data::{Attenuation, Integrator, Light, LightKind};
use crate::scene::validate::{MAX_COORDINATE, MAX_LIGHT, MAX_SHADOW_SAMPLES};

pub(super) const LIGHT_KEYS: &[&str] = &[
    "kind",
    "position",
    "direction",
    "look_at",
    "color",
    "intensity",
    "attenuation",
    "beam_angle",
    "penumbra",
    "radius",
    "shadow_samples",
    "shadows",
];

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Point,
    Spot,
    Directional,
}

/// Reads a light of a scene that is rendered by `integrator`.
pub(super) fn light(table: Table<'_>, integrator: &Integrator, reading: &mut Reading) -> Read<Light> {
    let kinds = [("point", Kind::Point), ("spot", Kind::Spot), ("directional", Kind::Directional)];
    let kind = table.read("kind", |value| value.word(&kinds))?.unwrap_or(Kind::Point);
    let radius = |value: Value<'_>| value.number("from 0 to 1e30", |n| (0.0..=MAX_COORDINATE).contains(&n));
    let radius = table.read("radius", radius)?.unwrap_or(0.0);
    let samples = |value: Value<'_>| value.whole("from 1 to 1024", 1..=u32::from(MAX_SHADOW_SAMPLES));
    let shadow_samples = table.read("shadow_samples", samples)?.map(|samples| samples as u16);
    let light = Light {
        kind: match kind {
            Kind::Point => LightKind::Point { position: table.required("position")?.vector()? },
            Kind::Spot => spot(table)?,
            Kind::Directional => {
                LightKind::Directional { direction: table.required("direction")?.direction()? }
            }
        },
        color: color(table)?,
        attenuation: table.read("attenuation", attenuation)?.unwrap_or(Attenuation::None),
        shadows: table.read("shadows", |value| value.boolean())?.unwrap_or(true),
        radius: if kind == Kind::Directional { 0.0 } else { radius },
        shadow_samples,
    };
    warn_about_unused_keys(table, kind, light.attenuation, reading)?;
    warn_about_extent(table, kind, radius, &light, reading);
    match integrator {
        Integrator::Direct => warn_about_points(table, &light, reading),
        Integrator::Path(_) => reading.idle(table, "shadow_samples", knobs::with(integrator)),
    }
    Ok(light)
}

fn color(table: Table<'_>) -> Read<glam::Vec3> {
    let limit = f64::from(MAX_LIGHT);
    let color = table.read("color", |value| value.color(MAX_LIGHT))?.unwrap_or(glam::Vec3::ONE);
    let Some(intensity) = table.get("intensity") else { return Ok(color) };
    let factor = intensity.number("from 0 to 1e30", |n| (0.0..=limit).contains(&n))?;
    let scaled = color.as_dvec3() * factor;
    if scaled.max_element() > limit {
        return Err(intensity.fault(format!("{intensity} times `color` must not exceed 1e30")));
    }
    Ok(scaled.as_vec3())
}

fn spot(table: Table<'_>) -> Read<LightKind> {
    let position = table.required("position")?.vector()?;
    let aim = table
        .one_of(&["direction", "look_at"])?
        .ok_or_else(|| table.fault("`direction` is missing in [[light]] (a spot needs it, or `look_at`)"))?;
    let beam = |value: Value<'_>| value.number("above 0 and at most 360 degrees", |n| n > 0.0 && n <= 360.0);
    let beam_angle = table.read("beam_angle", beam)?.unwrap_or(40.0);
    let edge = |value: Value<'_>| {
        value.number("of degrees from 0 to half the `beam_angle`", |n| (0.0..=beam_angle / 2.0).contains(&n))
    };
    let penumbra = table.read("penumbra", edge)?.unwrap_or(0.0);
    Ok(LightKind::Spot { position, direction: axis(aim, position)?, beam_angle, penumbra })
}

fn axis(aim: Value<'_>, position: DVec3) -> Read<DVec3> {
    if aim.name == "direction" {
        return aim.direction();
    }
    unit(aim.vector()? - position).ok_or_else(|| aim.must_be("another point than the light's `position`"))
}

fn attenuation(value: Value<'_>) -> Read<Attenuation> {
    if !value.table() {
        return value.word(&[("none", Attenuation::None), ("inverse_square", Attenuation::InverseSquare)]);
    }
    let name = "`attenuation` in [[light]]";
    let table = Table::open(name, value.value, &["constant", "linear", "quadratic"])?;
    let term = |key| {
        let read = |value: Value<'_>| value.number("from 0 to 1e30", |n| (0.0..=1e30).contains(&n));
        table.read(key, read).map(Option::unwrap_or_default)
    };
    let (constant, linear, quadratic) = (term("constant")?, term("linear")?, term("quadratic")?);
    if constant + linear + quadratic == 0.0 {
        return Err(value.fault(format!("{name} must have a term above 0: it divides the light")));
    }
    Ok(Attenuation::Polynomial { constant, linear, quadratic })
}

/// Warns about a radius that changes no shadow.
fn warn_about_extent(table: Table<'_>, kind: Kind, radius: f64, light: &Light, reading: &mut Reading) {
    if radius > 0.0 && kind == Kind::Directional {
        reading.idle(table, "radius", "on a directional light");
    } else if radius > 0.0 && !light.shadows {
        reading.idle(table, "radius", "on a light without shadows");
    }
}

/// Warns about a number of points that changes no shadow.
fn warn_about_points(table: Table<'_>, light: &Light, reading: &mut Reading) {
    if light.radius == 0.0 || !light.shadows {
        reading.idle(table, "shadow_samples", "without a `radius` and shadows");
    }
}

/// Warns about keys of other kinds of light: they have no effect, and are probably a mistake.
fn warn_about_unused_keys(
    table: Table<'_>,
    kind: Kind,
    attenuation: Attenuation,
    reading: &mut Reading,
) -> Read<()> {
    let (name, idle): (_, &[&'static str]) = match kind {
        Kind::Point => ("point", &["direction", "look_at", "beam_angle", "penumbra"]),
        Kind::Spot => ("spot", &[]),
        Kind::Directional => ("directional", &["position", "look_at", "beam_angle", "penumbra"]),
    };
    for (key, value) in idle.iter().filter_map(|key| Some((key, table.get(key)?))) {
        match value.name {
            "beam_angle" | "penumbra" => value.number("of degrees", |_| true).map(drop)?,
            _ => value.vector().map(drop)?,
        }
        reading.idle(table, key, &format!("on a {name} light"));
    }
    if kind == Kind::Directional && attenuation != Attenuation::None {
        reading.idle(table, "attenuation", &format!("on a {name} light"));
    }
    Ok(())
}
