//! The general ladder: costs and losses of the knobs on other scenes, for a scene without a table of its own.
//!
//! Costs multiply and losses add up, knob by knob. That is a rough start: the costs are then estimated from the frames. The
//! figures are medians of the tables in `models/tradeoff`, which `tradeoff` has written: of three example scenes, a bust of
//! 99,938 triangles, and ten instances of it. Losses are FLIP against the same picture without the loss. Scenes differ by a
//! factor of four and more. The tables have no rows yet for the scales 1/3 and 1/4: their figures are extrapolated from those
//! of 3/4 and 1/2.

use rayfarm_tracer::scene::{ColorDepth, RenderScale, Scene, Shading};

use super::ladder::{Ladder, Origin, Rung};
use super::setting::{Setting, bytes};
use crate::viewer::view_request::ViewRequest;

/// Effect of one knob: factor of time, and added mean FLIP error.
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
    // Extrapolated from the two above (`small_scales`), not measured.
    (RenderScale::Third, Effect { cost: 0.222, loss: 0.0244 }),
    (RenderScale::Quarter, Effect { cost: 0.150, loss: 0.0354 }),
];
const NO_SHADOWS: Effect = Effect { cost: 0.503, loss: 0.0868 };
const DIFFUSE: Effect = Effect { cost: 0.971, loss: 0.0206 };
/// Effect of reduced colours on the threads; they relieve the wire.
const REDUCED: Effect = Effect { cost: 1.008, loss: 0.0523 };
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

/// Square numbers up to the requested number of samples.
fn sample_counts(most: u32) -> impl Iterator<Item = u32> + Clone {
    (1..=most.isqrt()).map(|side| side * side)
}

/// Expected cost and loss of a setting. A knob that the request reduces already has no effect.
fn rung(setting: Setting, wanted: &ViewRequest) -> Rung {
    let request = setting.applied(wanted);
    let (full, quality) = (wanted.view.quality, request.view.quality);
    let scale = |wanted: &ViewRequest| {
        SCALES.iter().find(|(scale, _)| *scale == wanted.scale).map_or(NONE, |(_, effect)| *effect)
    };
    let (before, after) = (scale(wanted), scale(&request));
    let (all, fewer) = (sampling(wanted), sampling(&request));
    let effects = [
        Effect { cost: after.cost / before.cost, loss: after.loss - before.loss },
        Effect { cost: fewer.cost / all.cost, loss: fewer.loss - all.loss },
        if quality.shadows == full.shadows { NONE } else { NO_SHADOWS },
        if quality.shading == full.shading { NONE } else { DIFFUSE },
        if quality.colors == full.colors { NONE } else { REDUCED },
    ];
    Rung {
        setting,
        wire: bytes(&request) / bytes(wanted),
        cost: effects.iter().map(|effect| effect.cost).product(),
        loss: effects.iter().map(|effect| effect.loss).sum(),
    }
}

/// Cost of a pixel's samples, in samples, and their error compared with very many.
fn sampling(request: &ViewRequest) -> Effect {
    let samples = f64::from(request.view.samples);
    let loss = ONE_SAMPLE / samples.sqrt();
    if request.view.is_adaptive() {
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
    use crate::measure::tradeoff::setting::Setting as Measured;
    use crate::measure::tradeoff::table::Table;

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
            let request = Measured::named(setting).unwrap().applied_to(&wanted(samples).view);
            let expected = rung(Setting::of(&request), &wanted(samples));
            let (cost, loss) = (median(&costs), median(&losses));
            let what = format!("{setting}: expected {expected:?}, measured {costs:?} and {losses:?}");
            assert!((expected.cost / cost - 1.0).abs() < 0.15, "{what}");
            assert!((expected.loss - loss).abs() < 0.1 * loss + 0.001, "{what}");
        }
    }

    #[test]
    fn the_small_scales_are_extrapolated_from_the_larger_ones() {
        let [full, three_quarters, half, third, quarter] = SCALES.map(|(_, effect)| effect);
        let known = [full, three_quarters, half].map(|effect| (effect.cost, effect.loss));
        for (effect, scale) in [(third, RenderScale::Third), (quarter, RenderScale::Quarter)] {
            let (cost, loss) = small_scales::continued(known, scale);
            assert!((effect.cost - cost).abs() < 6e-4 && (effect.loss - loss).abs() < 6e-5, "{cost}, {loss}");
        }
    }

    #[test]
    fn adaptive_sampling_is_the_first_rung_that_saves_half_the_time() {
        let rungs = ladder(&crate::test_scene::scene(), &wanted(16));
        let first = rungs.rungs().iter().find(|rung| rung.cost < 0.5).unwrap().setting.applied(&wanted(16));
        assert!(first.view.quality.adaptive && first.view.samples == 16, "{first:?}");
        assert_eq!(first.scale, RenderScale::Full);
    }

    #[test]
    fn the_ladder_ends_at_one_sample_and_a_quarter_of_the_size() {
        let last = ladder(&crate::test_scene::scene(), &wanted(256)).cheapest().applied(&wanted(256));
        assert_eq!((last.view.samples, last.scale), (1, RenderScale::Quarter));
    }
}
