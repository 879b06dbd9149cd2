//! The tables `[[light]]`.

use glam::DVec3;

use super::Reading;
use super::fault::Read;
use super::keys::{Keys, LIGHT_KEY_KEYS};
use super::knobs;
use super::table::Table;
use super::value::{Value, unit};
use crate::scene::animation::Shape;
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
    "key",
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
    let keys = Keys::of(table, "[[light.key]]", LIGHT_KEY_KEYS, reading)?;
    let position = keys.vector_or(table, "position", reading)?;
    let position = || position.map_or_else(|| table.required("position")?.vector(), Ok);
    let light = Light {
        kind: match kind {
            Kind::Point => LightKind::Point { position: position()? },
            Kind::Spot => spot(table, position()?, &keys, reading)?,
            Kind::Directional => {
                let Some(direction) = direction(table, &keys, reading)? else {
                    return Err(table.fault("`direction` is missing in [[light]]"));
                };
                LightKind::Directional { direction }
            }
        },
        color: color(table, &keys, reading)?,
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

fn color<'t>(table: Table<'t>, keys: &Keys<'t>, reading: &mut Reading) -> Read<glam::Vec3> {
    let limit = f64::from(MAX_LIGHT);
    let rgb = |value: Value<'t>| value.color(MAX_LIGHT).map(|color| color.as_dvec3());
    let color = keys.value_or(table, "color", Shape::Within, rgb, reading)?.unwrap_or(DVec3::ONE);
    let factor = |value: Value<'t>| value.number("from 0 to 1e30", |n| (0.0..=limit).contains(&n));
    let Some(factor) = keys.number_or(table, "intensity", factor, reading)? else {
        return Ok(color.as_vec3());
    };
    let scaled = color * factor;
    if scaled.max_element() > limit {
        let message = "`intensity` in [[light]] times `color` must not exceed 1e30";
        return Err(table
            .get("intensity")
            .map_or_else(|| table.fault(message), |value| value.fault(message)));
    }
    Ok(scaled.as_vec3())
}

/// The unit direction of a light, if it has one.
fn direction<'t>(table: Table<'t>, keys: &Keys<'t>, reading: &mut Reading) -> Read<Option<DVec3>> {
    let read = |value: Value<'t>| value.direction();
    let Some(direction) = keys.value_or(table, "direction", Shape::Round, read, reading)? else {
        return Ok(None);
    };
    match unit(direction) {
        Some(direction) => Ok(Some(direction)),
        None => Err(table.fault("`direction` in [[light.key]] passes through 0: add a key in between")),
    }
}

fn spot<'t>(table: Table<'t>, position: DVec3, keys: &Keys<'t>, reading: &mut Reading) -> Read<LightKind> {
    table.one_of(&["direction", "look_at"])?;
    let point = keys.vector_or(table, "look_at", reading)?;
    let own = direction(table, keys, reading)?;
    let direction = match (own, point) {
        (Some(direction), None) => direction,
        (None, Some(point)) => unit(point - position).ok_or_else(|| {
            let expected = "another point than the light's `position`";
            let fault = || table.fault(format!("`look_at` in [[light.key]] must be {expected}"));
            table.get("look_at").map_or_else(fault, |value| value.must_be(expected))
        })?,
        (Some(_), Some(_)) => {
            let message = "`direction` contradicts `look_at` in [[light]] with its keys; keep one of them";
            return Err(table.fault(message));
        }
        (None, None) => {
            let message = "`direction` is missing in [[light]] (a spot needs it, or `look_at`)";
            return Err(table.fault(message));
        }
    };
    let beam = |value: Value<'_>| value.number("above 0 and at most 360 degrees", |n| n > 0.0 && n <= 360.0);
    let beam_angle = table.read("beam_angle", beam)?.unwrap_or(40.0);
    let edge = |value: Value<'_>| {
        value.number("of degrees from 0 to half the `beam_angle`", |n| (0.0..=beam_angle / 2.0).contains(&n))
    };
    let penumbra = table.read("penumbra", edge)?.unwrap_or(0.0);
    Ok(LightKind::Spot { position, direction, beam_angle, penumbra })
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
