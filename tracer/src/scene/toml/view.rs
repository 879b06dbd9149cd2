//! The table `[render]`.

use super::Reading;
use super::fault::Read;
use super::knobs;
use super::table::Table;
use super::value::Value;
use crate::image::MAX_SIDE;
use crate::scene::data::{Integrator, PathSettings, RenderSettings, ToneCurve, ToneMapping};
use crate::scene::knobs::KNOBS;
use crate::scene::validate::MAX_EXPOSURE;

/// Keys of `[render]` that are no knobs.
const OTHER_KEYS: [&str; 5] = ["integrator", "seed", "max_noise", "exposure", "tone"];
const SIZE_KEYS: [&str; 2] = ["width", "height"];

/// Keys of `[render]`.
pub(super) fn render_keys() -> Vec<&'static str> {
    let knobs = KNOBS.iter().map(|knob| knob.key);
    SIZE_KEYS.into_iter().chain(knobs).chain(OTHER_KEYS).collect()
}

pub(super) fn render(table: Table<'_>, reading: &mut Reading) -> Read<RenderSettings> {
    let integrator = integrator(table, reading)?;
    let default = RenderSettings::with_integrator(integrator);
    let side = |value: Value<'_>| value.whole("of pixels from 1 to 16384", 1..=MAX_SIDE);
    let settings = RenderSettings {
        width: table.read("width", side)?.unwrap_or(default.width),
        height: table.read("height", side)?.unwrap_or(default.height),
        tone: tone(table)?,
        ..default
    };
    let setting = knobs::setting(table, default.setting(), reading)?;
    Ok(settings.with_setting(setting))
}

/// The integrator, with those of its settings that are no knobs.
fn integrator(table: Table<'_>, reading: &mut Reading) -> Read<Integrator> {
    let integrator = table.read("integrator", |value| value.word(&Integrator::WORDS))?.unwrap_or_default();
    let seed = table.read("seed", |value| value.whole("from 0 to 4294967295", 0..=u32::MAX))?;
    let share = |value: Value<'_>| value.number("from 0 to 1", |n| (0.0..=1.0).contains(&n));
    let max_noise = table.read("max_noise", share)?;
    Ok(match integrator {
        Integrator::Direct => {
            for key in ["seed", "max_noise"] {
                reading.idle(table, key, knobs::with(&integrator));
            }
            integrator
        }
        Integrator::Path(usual) => Integrator::Path(PathSettings {
            seed: seed.unwrap_or(usual.seed),
            max_noise: max_noise.map_or(usual.max_noise, |n| n as f32),
            ..usual
        }),
    })
}

/// Exposure and tone curve.
fn tone(table: Table<'_>) -> Read<ToneMapping> {
    let most = f64::from(MAX_EXPOSURE);
    let stops = |value: Value<'_>| value.number("of stops from -64 to 64", |n| (-most..=most).contains(&n));
    Ok(ToneMapping {
        exposure: table.read("exposure", stops)?.map_or(0.0, |n| n as f32),
        curve: table.read("tone", |value| value.word(&ToneCurve::WORDS))?.unwrap_or_default(),
    })
}
