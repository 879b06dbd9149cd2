//! What the knobs cost and lose on other scenes: the ladder where a scene has no table of its own.
//!
//! Costs multiply and losses add up, knob by knob. That is rough, and good enough to begin with: what the costs really are is
//! learnt from the frames. The figures are medians of the tables in `models/tradeoff`, which `tradeoff` has written: three of
//! the project's scenes, a bust, and ten of them. Losses are FLIP against the same picture without the loss. Scenes differ by
//! a factor of four, and more: without shadows, the room is another room. The tables have no rows yet for the scales 1/3 and
//! 1/4: what is expected of these two continues the row of 3/4 and 1/2.

use rayfarm_tracer::scene::{ColorDepth, RenderScale, Scene, Shading};

use super::ladder::{Ladder, Origin, Rung};
use super::setting::{Setting, bytes};
use crate::viewer::view_request::ViewRequest;

/// What turning one knob leaves of the time, and the mean FLIP error that it adds.
#[derive(Clone, Copy, Debug)]
struct Effect {
    cost: f64,
    loss: f64,
}

const NONE: Effect = Effect { cost: 1.0, loss: 0.0 };
const SCALES: [(RenderScale, Effect); 5] = [
    (RenderScale::Full, NONE),
    (RenderScale::ThreeQuarters, Effect { cost: 0.673, loss: 0.0062 }),
    (RenderScale::Half, Effect { cost: 0.387, loss: 0.0135 }),
    // Continued from the two above (`small_scales`), not measured.
    (RenderScale::Third, Effect { cost: 0.222, loss: 0.0244 }),
    (RenderScale::Quarter, Effect { cost: 0.150, loss: 0.0354 }),
];
const NO_SHADOWS: Effect = Effect { cost: 0.503, loss: 0.0868 };
const DIFFUSE: Effect = Effect { cost: 0.971, loss: 0.0206 };
/// What reduced colours do to the time of the threads, and lose: they are for the wire.
const REDUCED: Effect = Effect { cost: 1.008, loss: 0.0523 };
/// What a pixel costs beside its samples, in samples.
const PER_PIXEL: f64 = 0.38;
/// The error of one sample a pixel beside very many; that of n is taken to be smaller by the root of n.
const ONE_SAMPLE: f64 = 0.0115;
/// What a pixel of adaptive anti-aliasing costs however many samples are asked for, and for each of them, in samples.
const ADAPTIVE_PER_PIXEL: f64 = 2.0;
const ADAPTIVE_PER_SAMPLE: f64 = 0.165;
/// What it loses beside all samples everywhere.
const ADAPTIVE_LOSS: f64 = 0.0011;

/// The ladder for pictures of a scene.
pub(crate) fn ladder(scene: &Scene, wanted: &ViewRequest) -> Ladder {
    let mut rungs = Vec::new();
    for (scale, samples) in
        SCALES.iter().flat_map(|(scale, _)| sample_counts(wanted.view.samples).map(move |n| (*scale, n)))
    {
        for (adaptive, shadows) in [(false, true), (true, true), (false, false), (true, false)] {
            for (shading, colors) in [Shading::Full, Shading::Diffuse]
                .into_iter()
                .flat_map(|shading| [ColorDepth::Exact, ColorDepth::Reduced].map(|colors| (shading, colors)))
            {
                let adaptive = adaptive && samples > 1;
                let setting = Setting { samples, adaptive, scale, shadows, shading, colors, ..Setting::FULL };
                rungs.push(rung(setting.for_scene(scene), wanted));
            }
        }
    }
    Ladder::of(rungs, Origin::General)
}

/// Square numbers up to what is asked for.
fn sample_counts(most: u32) -> impl Iterator<Item = u32> + Clone {
    (1..=most.isqrt()).map(|side| side * side)
}

/// What is expected of a setting. A knob that is turned down already makes no difference.
fn rung(setting: Setting, wanted: &ViewRequest) -> Rung {
    let picture = setting.applied(wanted);
    let (full, quality) = (wanted.view.quality, picture.view.quality);
    let scale = |wanted: &ViewRequest| {
        SCALES.iter().find(|(scale, _)| *scale == wanted.scale).map_or(NONE, |(_, effect)| *effect)
    };
    let (before, after) = (scale(wanted), scale(&picture));
    let (all, fewer) = (sampling(wanted), sampling(&picture));
    let effects = [
        Effect { cost: after.cost / before.cost, loss: after.loss - before.loss },
        Effect { cost: fewer.cost / all.cost, loss: fewer.loss - all.loss },
        if quality.shadows == full.shadows { NONE } else { NO_SHADOWS },
        if quality.shading == full.shading { NONE } else { DIFFUSE },
        if quality.colors == full.colors { NONE } else { REDUCED },
    ];
    Rung {
        setting,
        wire: bytes(&picture) / bytes(wanted),
        cost: effects.iter().map(|effect| effect.cost).product(),
        loss: effects.iter().map(|effect| effect.loss).sum(),
    }
}

/// What a pixel's samples cost, in samples, and their error beside very many.
fn sampling(picture: &ViewRequest) -> Effect {
    let samples = f64::from(picture.view.samples);
    let loss = ONE_SAMPLE / samples.sqrt();
    if picture.view.is_adaptive() {
        Effect { cost: ADAPTIVE_PER_PIXEL + ADAPTIVE_PER_SAMPLE * samples, loss: loss + ADAPTIVE_LOSS }
    } else {
        Effect { cost: PER_PIXEL + samples, loss }
    }
}

#[cfg(test)]
mod tests {
    use rayfarm_tracer::scene::FrameView;

    use super::super::small_scales;
    use super::*;
    use crate::tradeoff::setting::Setting as Measured;
    use crate::tradeoff::table::Table;

    const TABLES: [&[u8]; 5] = [
        include_bytes!("../../../../models/tradeoff/room.csv"),
        include_bytes!("../../../../models/tradeoff/textured.csv"),
        include_bytes!("../../../../models/tradeoff/product.csv"),
        include_bytes!("../../../../models/tradeoff/bust.csv"),
        include_bytes!("../../../../models/tradeoff/ten-busts.csv"),
    ];

    fn wanted(samples: u32) -> ViewRequest {
        let view = FrameView { samples, ..crate::test_scene::view() };
        ViewRequest { view, scale: RenderScale::Full }
    }

    /// Cost and loss of a setting beside another one, in each table that has both, from the least to the greatest.
    fn measured(setting: &str, beside: &str) -> [Vec<f64>; 2] {
        let tables = TABLES.map(|text| Table::parse(text).unwrap());
        let row = |table: &Table, name: &str| table.rows.iter().find(|row| row.setting == name).cloned();
        let pairs = tables.iter().filter_map(|table| row(table, setting).zip(row(table, beside)));
        let pairs: Vec<_> = pairs.collect();
        assert!(pairs.len() >= 3, "{setting} beside {beside}");
        let sorted = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values
        };
        [
            sorted(pairs.iter().map(|(one, other)| one.median_ms / other.median_ms).collect()),
            sorted(pairs.iter().map(|(one, other)| one.flip - other.flip).collect()),
        ]
    }

    /// Alone, a knob is expected to do about what it did to the scenes that were measured, in the middle.
    #[test]
    fn knobs_are_expected_to_do_what_was_measured() {
        let median = |values: &[f64]| values[values.len() / 2];
        for (setting, beside, samples) in [
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
            let [costs, losses] = measured(setting, beside);
            let picture = Measured::named(setting).unwrap().applied_to(&wanted(samples).view);
            let expected = rung(Setting::of(&picture), &wanted(samples));
            let (cost, loss) = (median(&costs), median(&losses));
            let what = format!("{setting}: expected {expected:?}, measured {costs:?} and {losses:?}");
            assert!((expected.cost / cost - 1.0).abs() < 0.15, "{what}");
            assert!((expected.loss - loss).abs() < 0.1 * loss + 0.001, "{what}");
        }
    }

    #[test]
    fn the_small_scales_are_what_the_larger_ones_lead_to() {
        let [full, three_quarters, half, third, quarter] = SCALES.map(|(_, effect)| effect);
        let known = [full, three_quarters, half].map(|effect| (effect.cost, effect.loss));
        for (effect, scale) in [(third, RenderScale::Third), (quarter, RenderScale::Quarter)] {
            let (cost, loss) = small_scales::continued(known, scale);
            assert!((effect.cost - cost).abs() < 6e-4 && (effect.loss - loss).abs() < 6e-5, "{cost}, {loss}");
        }
    }

    #[test]
    fn half_the_time_is_saved_where_neighbours_do_not_differ_before_anything_else_is_left_out() {
        let rungs = ladder(&crate::test_scene::scene(), &wanted(16));
        let first = rungs.rungs().iter().find(|rung| rung.cost < 0.5).unwrap().setting.applied(&wanted(16));
        assert!(first.view.quality.adaptive && first.view.samples == 16, "{first:?}");
        assert_eq!(first.scale, RenderScale::Full);
    }

    #[test]
    fn however_much_is_asked_for_the_ladder_goes_down_to_the_cheapest() {
        let last = ladder(&crate::test_scene::scene(), &wanted(256)).cheapest().applied(&wanted(256));
        assert_eq!((last.view.samples, last.scale), (1, RenderScale::Quarter));
    }
}
