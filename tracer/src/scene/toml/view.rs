//! The table `[render]`.

use super::fault::Read;
use super::knobs;
use super::table::Table;
use super::value::Value;
use crate::image::MAX_SIDE;
use crate::scene::data::RenderSettings;
use crate::scene::knobs::KNOBS;
use crate::scene::validate::MAX_DEPTH;

/// Keys of `[render]` that are no knobs.
const INTEGRATOR: &str = "integrator";
const SIZE_KEYS: [&str; 2] = ["width", "height"];
const BOUNCE_KEYS: [&str; 2] = ["max_depth", "min_contribution"];

/// Keys of `[render]`.
pub(super) fn render_keys() -> Vec<&'static str> {
    let knobs = KNOBS.iter().map(|knob| knob.key);
    SIZE_KEYS.into_iter().chain(knobs).chain(BOUNCE_KEYS).chain([INTEGRATOR]).collect()
}

pub(super) fn render(table: Table<'_>) -> Read<RenderSettings> {
    table.read(INTEGRATOR, integrator)?;
    let default = RenderSettings::default();
    let side = |value: Value<'_>| value.whole("of pixels from 1 to 16384", 1..=MAX_SIDE);
    let share = |value: Value<'_>| value.number("from 0 to 1", |n| (0.0..=1.0).contains(&n));
    let settings = RenderSettings {
        width: table.read("width", side)?.unwrap_or(default.width),
        height: table.read("height", side)?.unwrap_or(default.height),
        ..default
    };
    let mut setting = knobs::setting(table, default.setting())?;
    let depth = |value: Value<'_>| value.whole("from 0 to 64", 0..=u32::from(MAX_DEPTH));
    if let Some(depth) = table.read("max_depth", depth)? {
        setting.quality.max_depth = depth as u8;
    }
    if let Some(share) = table.read("min_contribution", share)? {
        setting.quality.min_contribution = share as f32;
    }
    Ok(settings.with_setting(setting))
}

/// Accepts the only integrator that is built.
fn integrator(value: Value<'_>) -> Read<()> {
    let is_path = value.word(&[("direct", false), ("path", true)])?;
    if is_path { Err(value.not_yet("the path integrator", "use \"direct\"")) } else { Ok(()) }
}
