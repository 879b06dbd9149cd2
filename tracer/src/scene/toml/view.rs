//! The table `[render]`.

use super::fault::Read;
use super::knobs;
use super::table::Table;
use super::value::Value;
use crate::image::MAX_SIDE;
use crate::scene::data::RenderSettings;
use crate::scene::knobs::KNOBS;

/// Keys of `[render]` that are no knobs.
const INTEGRATOR: &str = "integrator";
const SIZE_KEYS: [&str; 2] = ["width", "height"];

/// Keys of `[render]`.
pub(super) fn render_keys() -> Vec<&'static str> {
    let knobs = KNOBS.iter().map(|knob| knob.key);
    SIZE_KEYS.into_iter().chain(knobs).chain([INTEGRATOR]).collect()
}

pub(super) fn render(table: Table<'_>) -> Read<RenderSettings> {
    table.read(INTEGRATOR, integrator)?;
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

/// Accepts the only integrator that is built.
fn integrator(value: Value<'_>) -> Read<()> {
    let is_path = value.word(&[("direct", false), ("path", true)])?;
    if is_path { Err(value.not_yet("the path integrator", "use \"direct\"")) } else { Ok(()) }
}
