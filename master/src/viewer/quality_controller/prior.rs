//! The general ladder: costs and losses of the knobs on other scenes, for a scene without a table of its own.
//!
//! Costs multiply and losses add up, knob by knob. That is a rough start: the costs are then estimated from the frames. The
//! figures are medians of the tables in `models/tradeoff`, which `tradeoff` has written: of three example scenes, a bust of
//! 99,938 triangles, and ten instances of it. Losses are FLIP against the same picture without the loss. Scenes differ by a
//! factor of four and more. The scales 1/3 and 1/4 have a table of their own, `small-scales.csv`.

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::scene::knobs::{KNOBS, Knob, KnobValue};
use rayfarm_tracer::scene::{Integrator, Scene, SceneFeatures, Setting};

use super::ladder::{Ladder, Origin, Rung};
use super::wire::bytes;

/// Effect of one knob: factor of time, and added mean FLIP error.
#[derive(Clone, Copy, Debug)]
struct Effect {
    cost: f64,
    loss: f64,
}

impl Effect {
    const NONE: Self = Self { cost: 1.0, loss: 0.0 };

    /// Effect of a change from a value with the effect `before` to one with this effect.
    fn compared_with(self, before: Self) -> Self {
        Self { cost: self.cost / before.cost, loss: self.loss - before.loss }
    }
}

/// Known effects of values, by slug. Other values are not on the ladder, except those of [`SAMPLING`].
const EFFECTS: [(&str, Effect); 7] = [
    ("scale-3-4", Effect { cost: 0.673, loss: 0.0062 }),
    ("scale-1-2", Effect { cost: 0.387, loss: 0.0135 }),
    ("scale-1-3", Effect { cost: 0.206, loss: 0.0259 }),
    ("scale-1-4", Effect { cost: 0.137, loss: 0.0321 }),
    ("no-shadows", Effect { cost: 0.503, loss: 0.0868 }),
    ("diffuse", Effect { cost: 0.971, loss: 0.0206 }),
    // The effect on the threads; reduced colours relieve the wire.
    ("reduced-colors", Effect { cost: 1.008, loss: 0.0523 }),
];
/// Knobs whose common effect is [`sampling`].
const SAMPLING: [&str; 2] = ["samples", "adaptive"];
/// Cost of a pixel without its samples, in samples.
const PER_PIXEL: f64 = 0.38;
/// Error of one sample per pixel compared with very many; that of n is smaller by the square root of n.
const ONE_SAMPLE: f64 = 0.0115;
/// Cost of a pixel of adaptive anti-aliasing, fixed and per requested sample, in samples.
const ADAPTIVE_PER_PIXEL: f64 = 2.0;
const ADAPTIVE_PER_SAMPLE: f64 = 0.165;
/// Error of adaptive anti-aliasing compared with all samples everywhere.
const ADAPTIVE_LOSS: f64 = 0.0011;

/// General ladder for pictures of a scene.
pub(crate) fn ladder(scene: &Scene, wanted: &ViewRequest) -> Ladder {
    let features = SceneFeatures::of(scene);
    let settings = settings(wanted.view.integrator, wanted.view.samples).into_iter();
    Ladder::of(settings.map(|setting| rung(setting.without_idle(&features), wanted)), Origin::General)
}

/// All combinations of values whose effects are known, with at most `samples` rays per pixel.
fn settings(integrator: Integrator, samples: u32) -> Vec<Setting> {
    let knobs = KNOBS.iter().filter(|knob| knob.has_effect_with(&integrator));
    knobs.fold(vec![Setting::full_with(integrator)], |settings, knob| {
        let values: Vec<&KnobValue> =
            knob.values_with(integrator).rev().filter(|value| is_known(knob, value)).collect();
        let combined = settings.iter().flat_map(|setting| values.iter().map(|value| with(value, *setting)));
        combined.filter(|setting| setting.samples <= samples).collect()
    })
}

/// Whether the effect of a value is known. The best value has none.
fn is_known(knob: &Knob, value: &KnobValue) -> bool {
    let is_best = std::ptr::eq(value, knob.best());
    is_best || SAMPLING.contains(&knob.name) || value.slug.is_some_and(|slug| effect(slug).is_some())
}

/// The setting with another value of one knob.
fn with(value: &KnobValue, mut setting: Setting) -> Setting {
    value.apply(&mut setting);
    setting
}

fn effect(slug: &str) -> Option<Effect> {
    EFFECTS.iter().find(|(known, _)| *known == slug).map(|(_, effect)| *effect)
}

/// Expected cost and loss of a setting. A knob that the request reduces already has no effect.
fn rung(setting: Setting, wanted: &ViewRequest) -> Rung {
    let request = wanted.at_most(&setting);
    let (before, after) = (wanted.setting(), request.setting());
    let of_knob = |knob: &Knob| {
        let value = |setting| knob.value_of(setting).slug.and_then(effect).unwrap_or(Effect::NONE);
        value(&after).compared_with(value(&before))
    };
    let sampled = sampling(&after).compared_with(sampling(&before));
    let effects: Vec<Effect> = std::iter::once(sampled).chain(KNOBS.iter().map(of_knob)).collect();
    Rung {
        setting,
        wire: bytes(&request) / bytes(wanted),
        cost: effects.iter().map(|effect| effect.cost).product(),
        loss: effects.iter().map(|effect| effect.loss).sum(),
    }
}

/// Cost of a pixel's samples, in samples, and their error compared with very many.
fn sampling(setting: &Setting) -> Effect {
    let samples = f64::from(setting.samples);
    let loss = ONE_SAMPLE / samples.sqrt();
    if setting.quality.adaptive && setting.samples > 1 {
        Effect { cost: ADAPTIVE_PER_PIXEL + ADAPTIVE_PER_SAMPLE * samples, loss: loss + ADAPTIVE_LOSS }
    } else {
        Effect { cost: PER_PIXEL + samples, loss }
    }
}

#[cfg(test)]
mod tests {
    use rayfarm_tracer::scene::{FrameView, PathSettings, RenderScale};

    use super::*;
    use crate::measure::tradeoff::setting::MeasuredSetting;
    use crate::measure::tradeoff::table::Table;
    use crate::viewer::film::passes::while_moving;

    const TABLES: [&[u8]; 5] = [
        include_bytes!("../../../../models/tradeoff/room.csv"),
        include_bytes!("../../../../models/tradeoff/textured.csv"),
        include_bytes!("../../../../models/tradeoff/product.csv"),
        include_bytes!("../../../../models/tradeoff/bust.csv"),
        include_bytes!("../../../../models/tradeoff/ten-busts.csv"),
    ];

    fn wanted(samples: u32) -> ViewRequest {
        let view = FrameView { samples, ..rayfarm_farm::testing::test_scene::view() };
        ViewRequest { view, scale: RenderScale::Full }
    }

    /// Cost and loss of a setting compared with a baseline, in each table that has both, in ascending order.
    fn measured(setting: &str, baseline: &str) -> [Vec<f64>; 2] {
        let tables = TABLES.map(|text| Table::parse(text).unwrap());
        let row = |table: &Table, name: &str| table.rows.iter().find(|row| row.setting == name).cloned();
        let pairs = tables.iter().filter_map(|table| row(table, setting).zip(row(table, baseline)));
        let pairs: Vec<_> = pairs.collect();
        assert!(pairs.len() >= 3, "{setting} against {baseline}");
        let sorted = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values
        };
        [
            sorted(pairs.iter().map(|(one, other)| one.median_ms / other.median_ms).collect()),
            sorted(pairs.iter().map(|(one, other)| one.flip - other.flip).collect()),
        ]
    }

    #[test]
    fn each_knob_alone_has_about_the_median_measured_effect() {
        let median = |values: &[f64]| values[values.len() / 2];
        for (setting, baseline, samples) in [
            ("scale-3-4", "samples-1", 1),
            ("scale-1-2", "samples-1", 1),
            ("reduced-colors", "samples-1", 1),
            ("no-shadows", "samples-1", 1),
            ("diffuse", "samples-1", 1),
            ("samples-1", "samples-16", 16),
            ("samples-4", "samples-16", 16),
            ("samples-9", "samples-16", 16),
            ("samples-4+adaptive", "samples-4", 4),
            ("samples-9+adaptive", "samples-9", 9),
            ("samples-16+adaptive", "samples-16", 16),
        ] {
            let [costs, losses] = measured(setting, baseline);
            let request = MeasuredSetting::named(setting).unwrap().applied_to(&wanted(samples).view);
            let expected = rung(request.setting(), &wanted(samples));
            let (cost, loss) = (median(&costs), median(&losses));
            let what = format!("{setting}: expected {expected:?}, measured {costs:?} and {losses:?}");
            assert!((expected.cost / cost - 1.0).abs() < 0.15, "{what}");
            assert!((expected.loss - loss).abs() < 0.1 * loss + 0.001, "{what}");
        }
    }

    #[test]
    fn every_effect_is_of_a_value_of_the_table() {
        let slugs: Vec<&str> =
            KNOBS.iter().flat_map(|knob| knob.values).filter_map(|value| value.slug).collect();
        assert!(EFFECTS.iter().all(|(slug, _)| slugs.contains(slug)));
        assert!(SAMPLING.iter().all(|name| Knob::named(name).is_some()));
    }

    /// Least time in milliseconds and FLIP error of a setting, for each scene of `small-scales.csv`.
    fn small_scales(setting: &str) -> Vec<(f64, f64)> {
        let text = include_bytes!("../../../../models/tradeoff/small-scales.csv");
        let records = csv::Reader::from_reader(text.as_slice()).into_records().map(Result::unwrap);
        let rows = records.filter(|record| &record[5] == setting);
        rows.map(|record| (record[6].parse().unwrap(), record[8].parse().unwrap())).collect()
    }

    #[test]
    fn the_small_scales_have_the_median_measured_effect() {
        let full = small_scales("samples-1");
        assert_eq!(full.len(), 5);
        let median = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        for setting in ["scale-1-3", "scale-1-4"] {
            let scaled = small_scales(setting);
            assert_eq!(scaled.len(), full.len());
            let cost = median(scaled.iter().zip(&full).map(|(scaled, full)| scaled.0 / full.0).collect());
            let loss = median(scaled.iter().zip(&full).map(|(scaled, full)| scaled.1 - full.1).collect());
            let expected = effect(setting).unwrap();
            assert!((expected.cost / cost - 1.0).abs() < 0.02, "{setting}: {expected:?}, measured {cost}");
            assert!((expected.loss - loss).abs() < 1e-4, "{setting}: {expected:?}, measured {loss}");
        }
    }

    #[test]
    fn adaptive_sampling_is_the_first_rung_that_saves_half_the_time() {
        let rungs = ladder(&rayfarm_farm::testing::test_scene::scene(), &wanted(16));
        let first = rungs.rungs().iter().find(|rung| rung.cost < 0.5).unwrap();
        let first = wanted(16).at_most(&first.setting);
        assert!(first.view.quality.adaptive && first.view.samples == 16, "{first:?}");
        assert_eq!(first.scale, RenderScale::Full);
    }

    /// A moving picture of paths has one sample, so that its rungs are scales. Neither depth nor roulette has a general effect.
    #[test]
    fn moving_pictures_of_paths_have_rungs_of_all_scales_and_one_sample() {
        let integrator = Integrator::Path(PathSettings::default());
        let view = FrameView { integrator, ..wanted(64).view };
        let moving = while_moving(&ViewRequest { view, scale: RenderScale::Full });
        let ladder = ladder(&rayfarm_farm::testing::test_scene::scene(), &moving);
        let rungs: Vec<ViewRequest> =
            ladder.rungs().iter().map(|rung| moving.at_most(&rung.setting)).collect();
        assert!(rungs.iter().all(|rung| rung.view.samples == 1 && rung.view.integrator == integrator));
        assert!(RenderScale::ALL.iter().all(|scale| rungs.iter().any(|rung| rung.scale == *scale)));
        assert_eq!(rungs.len(), RenderScale::ALL.len());
    }

    #[test]
    fn the_ladder_ends_at_one_sample_and_a_quarter_of_the_size() {
        let last = wanted(256)
            .at_most(&ladder(&rayfarm_farm::testing::test_scene::scene(), &wanted(256)).cheapest());
        assert_eq!((last.view.samples, last.scale), (1, RenderScale::Quarter));
    }
}
