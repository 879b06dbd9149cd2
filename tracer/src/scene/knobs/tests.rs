//! The table against the values that it describes.

use std::collections::BTreeSet;

use proptest::prelude::*;

use super::number::Order;
use super::*;
use crate::scene::data::{PathSettings, RenderSettings, Sampler};
use crate::scene::validate::{
    MAX_CLAMP, MAX_DEPTH, MAX_PATH_SAMPLES, MAX_SAMPLES, MAX_SHADOW_SAMPLES, is_sample_count,
};
use crate::texture::Filter;

fn all_off() -> SceneFeatures {
    SceneFeatures::default()
}

const PATHS: Integrator = Integrator::Path(PathSettings::DEFAULT);

/// The best values with the integrator that has the knob.
fn full(knob: &Knob) -> Setting {
    Setting::full_with(if knob.scope == KnobScope::Paths { PATHS } else { Integrator::Direct })
}

/// Name, key and option of each knob.
const NAMES: [[&str; 3]; 16] = [
    ["samples"; 3],
    ["scale"; 3],
    ["adaptive"; 3],
    ["shadows"; 3],
    ["shadow_samples", "shadow_samples", "shadow-samples"],
    ["terminator", "smooth_terminator", "smooth-terminator"],
    ["shading"; 3],
    ["depth", "max_depth", "max-depth"],
    ["min_contribution", "min_contribution", "min-contribution"],
    ["sampler"; 3],
    ["roulette"; 3],
    ["clamp_indirect", "clamp_indirect", "clamp-indirect"],
    ["filter"; 3],
    ["exponent"; 3],
    ["colors", "pixels", "colors"],
    ["dither"; 3],
];

#[test]
fn knobs_have_their_names_keys_and_options() {
    let found: Vec<[&str; 3]> = KNOBS.iter().map(|knob| [knob.name, knob.key, knob.option]).collect();
    assert_eq!(found, NAMES);
}

#[test]
fn words_of_values_are_the_best_first() {
    let words = |name: &str| Knob::named(name).unwrap().words().collect::<Vec<_>>();
    assert_eq!(words("scale"), ["1", "3/4", "1/2", "1/3", "1/4"]);
    assert_eq!(words("adaptive"), ["off", "on"]);
    assert_eq!(words("shadows"), ["on", "off"]);
    assert_eq!(words("shadow_samples"), ["1024", "256", "64", "36", "25", "16", "9", "4", "1"]);
    assert_eq!(words("terminator"), ["on", "off"]);
    assert_eq!(words("shading"), ["full", "diffuse", "normals", "depth", "item", "albedo"]);
    assert_eq!(words("depth"), ["64", "16", "8", "5", "3", "2", "1", "0"]);
    assert_eq!(words("min_contribution"), ["0", "0.001", "0.004", "0.01", "0.03", "0.1"]);
    assert_eq!(words("filter"), ["trilinear", "bilinear", "nearest"]);
    assert_eq!(words("exponent"), ["exact", "fast"]);
    assert_eq!(words("colors"), ["exact", "reduced"]);
    assert_eq!(words("dither"), ["off", "on"]);
    assert_eq!(words("sampler"), ["sobol", "independent"]);
    assert_eq!(words("roulette"), ["on", "off"]);
    assert_eq!(words("clamp_indirect"), ["0", "10", "1"]);
}

#[test]
fn each_integrator_has_its_numbers_of_samples() {
    let knob = Knob::named("samples").unwrap();
    let samples = |integrator| -> Vec<u32> {
        knob.values_with(integrator).map(|value| value.word.unwrap().parse().unwrap()).collect()
    };
    let squares: Vec<u32> =
        (1..=MAX_SAMPLES).filter(|count| is_sample_count(&Integrator::Direct, *count)).collect();
    assert_eq!(samples(Integrator::Direct), squares);
    let powers: Vec<u32> = (0..=16).map(|exponent| 1 << exponent).collect();
    assert_eq!(samples(PATHS), powers);
    assert_eq!(powers.last(), Some(&MAX_PATH_SAMPLES));
    let listed = |integrator| samples(integrator).into_iter().collect::<BTreeSet<u32>>();
    assert_eq!(listed(Integrator::Direct).union(&listed(PATHS)).count(), knob.values.len());
    let shading = Knob::named("shading").unwrap();
    assert_eq!(shading.values_with(PATHS).count(), shading.values.len());
}

#[test]
fn every_value_is_found_again_in_a_setting_that_has_it() {
    let mut slugs = BTreeSet::new();
    for knob in KNOBS {
        for value in knob.all() {
            let mut setting = full(knob);
            value.apply(&mut setting);
            assert!(std::ptr::eq(knob.value_of(&setting), value), "{} {:?}", knob.name, value.word);
            for text in value.word.iter().chain(value.aliases) {
                assert!(knob.value(text).is_some_and(|found| std::ptr::eq(found, value)), "{text}");
            }
            assert!(value.slug.is_none_or(|slug| slugs.insert(slug)), "{:?}", value.slug);
        }
        assert!(std::ptr::eq(knob.value_of(&Setting::FULL), knob.best()), "{}", knob.name);
        assert!(knob.value("no such value").is_none());
    }
    assert!(Knob::named("no such knob").is_none());
}

#[test]
fn values_set_what_their_words_say() {
    let set = |name: &str, word: &str| {
        let knob = Knob::named(name).unwrap();
        let mut setting = full(knob);
        knob.value(word).unwrap().apply(&mut setting);
        setting
    };
    let path = |name: &str, word: &str| *set(name, word).integrator.path().unwrap();
    for (word, sampler) in Sampler::WORDS {
        assert_eq!(path("sampler", word).sampler, sampler);
    }
    assert!(path("roulette", "on").roulette && !path("roulette", "off").roulette);
    assert_eq!(path("clamp_indirect", "10").clamp_indirect, 10.0);
    assert_eq!(set("samples", "16").samples, 16);
    for (word, scale) in RenderScale::WORDS {
        assert_eq!(set("scale", word).scale, scale);
    }
    for (alias, scale) in
        [("0.75", RenderScale::ThreeQuarters), ("0.5", RenderScale::Half), ("0.25", RenderScale::Quarter)]
    {
        assert_eq!(set("scale", alias).scale, scale);
    }
    assert!(set("adaptive", "on").quality.adaptive && !set("shadows", "off").quality.shadows);
    assert!(set("dither", "on").quality.dither);
    assert_eq!(set("depth", "3").quality.max_depth, 3);
    assert_eq!(set("min_contribution", "0.03").quality.min_contribution, 0.03);
    assert_eq!(set("shadow_samples", "25").quality.shadow_samples, 25);
    assert!(!set("terminator", "off").quality.smooth_terminator);
    for (word, shading) in Shading::WORDS {
        assert_eq!(set("shading", word).quality.shading, shading);
    }
    for (word, filter) in Filter::WORDS {
        assert_eq!(set("filter", word).quality.filter, Some(filter));
    }
    for (word, exponent) in ExponentPrecision::WORDS {
        assert_eq!(set("exponent", word).quality.exponent, exponent);
    }
    for (word, colors) in ColorDepth::WORDS {
        assert_eq!(set("colors", word).quality.colors, colors);
    }
}

#[test]
fn listed_numbers_are_those_of_their_words_in_order() {
    for knob in KNOBS {
        let Some(range) = knob.range() else { continue };
        let number = |value: &KnobValue| {
            let mut setting = full(knob);
            value.apply(&mut setting);
            range.of(&setting)
        };
        for value in knob.values {
            assert_eq!(value.word.unwrap().parse(), Ok(number(value)), "{}", knob.name);
            assert!(range.contains(number(value).into()), "{}: {:?}", knob.name, value.word);
        }
        for pair in knob.values.windows(2) {
            let [cheaper, better] = [&pair[0], &pair[1]].map(number);
            assert!(range.is_cheaper(cheaper, better) && !range.is_cheaper(better, cheaper), "{}", knob.name);
        }
        let best = if range.order == Order::Rises { range.most } else { range.least };
        assert_eq!(range.of(&full(knob)), best, "{}", knob.name);
    }
}

#[test]
fn no_limit_of_indirect_light_is_better_than_any_limit() {
    let with = |clamp_indirect| {
        let settings = PathSettings { clamp_indirect, ..PathSettings::DEFAULT };
        Setting { integrator: Integrator::Path(settings), ..RenderSettings::with_integrator(PATHS).setting() }
    };
    assert_eq!(with(0.0).at_most(&with(10.0)), with(10.0));
    assert_eq!(with(10.0).at_most(&with(0.0)), with(10.0));
    assert_eq!(with(3.0).at_most(&with(10.0)), with(3.0));
    assert_eq!(with(10.0).at_most(&with(3.0)), with(3.0));
    assert_eq!(with(MAX_CLAMP).at_most(&with(0.0)), with(MAX_CLAMP));
    assert_eq!(with(2.5).reductions(), ["indirect light up to 2.5"]);
    assert_eq!(with(0.0).reductions(), [""; 0]);
}

#[test]
fn a_limit_changes_no_integrator() {
    let direct = RenderSettings::default().setting();
    let paths = RenderSettings::with_integrator(PATHS).setting();
    let cheapest = PathSettings {
        sampler: Sampler::Independent,
        roulette: false,
        clamp_indirect: 1.0,
        seed: 9,
        max_noise: 0.5,
    };
    let limit = Setting { integrator: Integrator::Path(cheapest), ..Setting::FULL };
    assert_eq!(direct.at_most(&limit), direct);
    assert_eq!(paths.at_most(&Setting::FULL), paths);
    // Neither the random seed nor the goal is a knob, and roulette reduces nothing.
    let limited = PathSettings { roulette: true, seed: 0, max_noise: 0.0, ..cheapest };
    assert_eq!(paths.at_most(&limit), Setting { integrator: Integrator::Path(limited), ..paths });
    let own = Setting { integrator: Integrator::Path(cheapest), ..paths };
    let restored = own.restored();
    let expected = PathSettings { sampler: Sampler::Sobol, ..cheapest };
    assert_eq!(restored.integrator, Integrator::Path(expected), "numbers are full quality");
    assert_eq!(restored.samples, MAX_PATH_SAMPLES);
}

#[test]
fn knobs_of_the_other_integrator_do_not_matter() {
    let everything = SceneFeatures {
        shadows: true,
        soft_shadows: true,
        smooth: true,
        bounces: true,
        specular: true,
        powers: true,
        filtered: true,
        ..all_off()
    };
    let matter = |integrator: Integrator| -> Vec<&str> {
        let usual = RenderSettings { samples: 4, ..RenderSettings::with_integrator(integrator) }.setting();
        KNOBS.iter().filter(|knob| knob.matters(&everything, &usual)).map(|knob| knob.name).collect()
    };
    let of_all = ["samples", "scale", "depth", "filter", "colors", "dither"];
    let of_direct =
        ["adaptive", "shadows", "shadow_samples", "terminator", "shading", "min_contribution", "exponent"];
    let of_paths = ["sampler", "roulette", "clamp_indirect"];
    let sorted = |names: &[&'static str]| names.iter().copied().collect::<BTreeSet<_>>();
    let found = |integrator| sorted(&matter(integrator));
    assert_eq!(found(Integrator::Direct), &sorted(&of_all) | &sorted(&of_direct));
    assert_eq!(found(PATHS), &sorted(&of_all) | &sorted(&of_paths));
    let depth = Knob::named("depth").unwrap();
    let usual = RenderSettings::with_integrator(PATHS).setting();
    assert!(depth.matters(&all_off(), &usual), "light bounces in every scene");
    assert_eq!(usual.reductions(), [""; 0]);
    let dark = Quality { shadows: false, max_depth: 5, ..usual.quality };
    assert_eq!(Setting { quality: dark, ..usual }.reductions(), ["depth 5"]);
}

#[test]
fn a_number_between_two_values_is_no_better_than_the_cheaper_one() {
    let word = |name: &str, setting: &Setting| Knob::named(name).unwrap().value_of(setting).word;
    let with = |quality| Setting { quality, ..Setting::FULL };
    for (depth, expected) in [(0, "0"), (4, "3"), (5, "5"), (7, "5"), (63, "16"), (64, "64")] {
        let setting = with(Quality { max_depth: depth, ..Quality::default() });
        assert_eq!(word("depth", &setting), Some(expected), "{depth}");
    }
    for (least, expected) in [(1.0, "0.1"), (0.05, "0.1"), (0.02, "0.03"), (0.003, "0.004"), (0.0, "0")] {
        let setting = with(Quality { min_contribution: least, ..Quality::default() });
        assert_eq!(word("min_contribution", &setting), Some(expected), "{least}");
    }
    for (samples, expected) in [(1, "1"), (3, "1"), (15, "9"), (1023, "256"), (1024, "1024")] {
        let setting = with(Quality { shadow_samples: samples, ..Quality::default() });
        assert_eq!(word("shadow_samples", &setting), Some(expected), "{samples}");
    }
}

#[test]
fn numbers_outside_of_a_range_are_not_contained() {
    let KnobForm::Number(depth) = Knob::named("depth").unwrap().form else { panic!("no number") };
    for (number, contained) in [
        (0.0, true),
        (7.0, true),
        (64.0, true),
        (65.0, false),
        (-1.0, false),
        (1.5, false),
        (f64::NAN, false),
    ] {
        assert_eq!(depth.contains(number), contained, "{number}");
    }
    let KnobForm::Number(least) = Knob::named("min_contribution").unwrap().form else { panic!("no number") };
    for (number, contained) in [(0.0, true), (0.05, true), (1.0, true), (1.01, false), (f64::INFINITY, false)]
    {
        assert_eq!(least.contains(number), contained, "{number}");
    }
}

/// The cheapest value of every knob, with several samples, so that all of them act.
fn cheapest() -> Setting {
    let mut setting = Setting::FULL;
    KNOBS.iter().for_each(|knob| knob.values[0].apply(&mut setting));
    Setting { samples: 4, ..setting }
}

/// The integrator that a number selects, with other settings than the default.
fn integrator(paths: bool) -> Integrator {
    let settings = PathSettings { seed: 3, max_noise: 0.125, ..PathSettings::DEFAULT };
    if paths { Integrator::Path(settings) } else { Integrator::Direct }
}

#[test]
fn a_limit_makes_nothing_better() {
    let cheapest = cheapest();
    assert_eq!(cheapest.at_most(&Setting::FULL), cheapest);
    let limited = Setting::FULL.at_most(&cheapest);
    // Dithering reduces nothing, so a limit does not turn it on.
    let undithered = Quality { dither: false, ..cheapest.quality };
    assert_eq!(limited, Setting { quality: undithered, ..cheapest });
    let bilinear = Quality { filter: Some(Filter::Bilinear), dither: true, ..Quality::default() };
    let own = Setting { quality: bilinear, ..Setting::FULL };
    assert_eq!(own.at_most(&Setting::FULL), own);
    let half = Setting { scale: RenderScale::Half, ..Setting::FULL };
    assert_eq!(own.at_most(&half), Setting { scale: RenderScale::Half, ..own });
}

#[test]
fn a_limit_lowers_numbers_to_its_own_and_not_to_listed_ones() {
    let with = |max_depth, min_contribution, shadow_samples| {
        let quality = Quality { max_depth, min_contribution, shadow_samples, ..Quality::default() };
        Setting { quality, ..Setting::FULL }
    };
    let own = with(7, 0.0002, 20);
    assert_eq!(own.at_most(&with(6, 0.02, 18)), with(6, 0.02, 18));
    assert_eq!(own.at_most(&with(8, 0.0001, 21)), own);
    assert_eq!(own.at_most(&with(6, 0.0001, 1024)), with(6, 0.0002, 20));
}

#[test]
fn pictures_without_light_are_neither_limits_nor_limited() {
    for shading in [Shading::Normals, Shading::Depth, Shading::Item, Shading::Albedo] {
        let shown = Setting { quality: Quality { shading, ..Quality::default() }, ..Setting::FULL };
        let limited = shown.at_most(&cheapest());
        assert_eq!((limited.quality.shading, limited.scale), (shading, RenderScale::Quarter));
        assert_eq!(Setting::FULL.at_most(&shown).quality.shading, Shading::Full);
        assert_eq!(cheapest().at_most(&shown).quality.shading, Shading::Diffuse);
        assert_eq!(limited.restored().quality.shading, shading);
        assert_eq!(shown.without_idle(&all_off()).quality.shading, shading);
        let dark = Quality { shadows: false, smooth_terminator: false, shadow_samples: 1, ..shown.quality };
        let dark = Setting { quality: Quality { max_depth: 0, min_contribution: 1.0, ..dark }, ..shown };
        assert_eq!(dark.reductions(), [""; 0], "the picture has no light: {shading:?}");
        assert!(Knob::named("shading").unwrap().matters(&all_off(), &shown));
    }
}

#[test]
fn full_quality_keeps_numbers_and_dither() {
    let full = cheapest().restored();
    let Quality { shadows, adaptive, shading, filter, exponent, colors, dither, .. } = full.quality;
    assert_eq!((full.samples, full.scale), (MAX_SAMPLES, RenderScale::Full));
    assert!(shadows && !adaptive && dither && full.quality.smooth_terminator);
    assert_eq!((shading, filter), (Shading::Full, None));
    assert_eq!((exponent, colors), (ExponentPrecision::Exact, ColorDepth::Exact));
    assert_eq!(
        (full.quality.max_depth, full.quality.min_contribution, full.quality.shadow_samples),
        (0, 0.1, 1)
    );
}

#[test]
fn knobs_that_make_no_difference_are_left_at_their_best() {
    let setting = cheapest().without_idle(&all_off());
    let Quality { shadows, adaptive, shading, filter, exponent, colors, dither, .. } = setting.quality;
    assert_eq!((shadows, shading, filter), (true, Shading::Full, None));
    assert_eq!((exponent, colors), (ExponentPrecision::Exact, ColorDepth::Reduced));
    assert!(adaptive && dither && setting.scale == RenderScale::Quarter);
    let Quality { max_depth, min_contribution, shadow_samples, smooth_terminator, .. } = setting.quality;
    assert_eq!((max_depth, shadow_samples), (MAX_DEPTH, MAX_SHADOW_SAMPLES));
    assert!(min_contribution == 0.0 && smooth_terminator);
    let glossy = SceneFeatures { specular: true, powers: true, shadows: true, ..all_off() };
    let setting = cheapest().without_idle(&glossy);
    assert_eq!(setting.quality.shading, Shading::Diffuse);
    assert_eq!(setting.quality.exponent, ExponentPrecision::Exact, "no highlight has an exponent any more");
    assert!(!setting.quality.shadows);
    let one = Setting { samples: 1, ..cheapest() }.without_idle(&glossy);
    assert!(!one.quality.adaptive, "one sample leaves nothing to adapt");
}

#[test]
fn knobs_of_bounces_and_soft_shadows_matter_where_the_scene_has_them() {
    let usual = RenderSettings::default().setting();
    let soft = SceneFeatures { shadows: true, soft_shadows: true, smooth: true, bounces: true, ..all_off() };
    let matter = |features: &SceneFeatures, setting: &Setting| -> Vec<&str> {
        let names = ["shadow_samples", "terminator", "depth", "min_contribution"];
        names.into_iter().filter(|name| Knob::named(name).unwrap().matters(features, setting)).collect()
    };
    assert_eq!(matter(&soft, &usual), ["shadow_samples", "terminator", "depth", "min_contribution"]);
    let hard = SceneFeatures { soft_shadows: false, smooth: false, ..soft };
    assert_eq!(matter(&hard, &usual), ["depth", "min_contribution"]);
    let unlit = Setting { quality: Quality { shadows: false, max_depth: 0, ..usual.quality }, ..usual };
    assert_eq!(matter(&soft, &unlit), ["depth"], "the knobs that are off can be turned on");
    let normals = Setting { quality: Quality { shading: Shading::Normals, ..usual.quality }, ..usual };
    assert_eq!(matter(&soft, &normals), [""; 0]);
}

#[test]
fn reductions_are_labelled() {
    assert_eq!(Setting::FULL.reductions(), [""; 0]);
    assert_eq!(RenderSettings::default().setting().reductions(), [""; 0]);
    let expected = [
        "scale 1/4",
        "adaptive samples",
        "no shadows",
        "diffuse only",
        "depth 0",
        "nearest texels",
        "fast exponent",
        "16-bit colours",
    ];
    assert_eq!(cheapest().reductions(), expected);
    let one = Setting { samples: 1, ..cheapest() };
    assert!(!one.reductions().contains(&"adaptive samples".into()));
    let quality = Quality {
        shadow_samples: 5,
        smooth_terminator: false,
        max_depth: 4,
        min_contribution: 0.25,
        ..Quality::default()
    };
    let fewer = Setting { quality, ..Setting::FULL };
    let expected = ["5 shadow samples", "hard terminator", "depth 4", "contributions from 0.25"];
    assert_eq!(fewer.reductions(), expected);
    let one = Setting { quality: Quality { shadow_samples: 1, ..Quality::default() }, ..Setting::FULL };
    assert_eq!(one.reductions(), ["1 shadow sample"]);
}

/// A value of each knob: one of its list, apart from its order, or any number of its range.
fn any_setting() -> impl Strategy<Value = Setting> {
    let picks =
        prop::collection::vec((any::<prop::sample::Index>(), 0.0..=1.0_f32, any::<bool>()), KNOBS.len());
    (any::<bool>(), picks).prop_map(|(paths, picks)| {
        let mut setting = Setting { integrator: integrator(paths), ..Setting::FULL };
        for (knob, (index, share, listed)) in KNOBS.iter().zip(picks) {
            let listed = listed || (matches!(knob.form, KnobForm::Count(_)) && !paths);
            match knob.form {
                KnobForm::Number(range) | KnobForm::Count(range) if !listed => {
                    let number = range.least + share * (range.most - range.least);
                    range.apply(if range.whole { number.round() } else { number }, &mut setting);
                }
                _ => {
                    let all: Vec<_> = knob.values_with(setting.integrator).chain(knob.apart).collect();
                    index.get(&all).apply(&mut setting);
                }
            }
        }
        setting
    })
}

proptest! {
    #[test]
    fn full_quality_as_a_limit_changes_no_setting(setting in any_setting()) {
        prop_assert_eq!(setting.at_most(&Setting::FULL), setting);
    }

    /// The limited setting is no better than both in every knob, and one of both.
    #[test]
    fn a_limited_setting_is_the_cheaper_of_both(own in any_setting(), limit in any_setting()) {
        let limited = own.at_most(&limit);
        prop_assert_eq!(limited.at_most(&limit), limited);
        prop_assert_eq!(limited.at_most(&own), limited);
        prop_assert_eq!(limited.quality.max_depth, own.quality.max_depth.min(limit.quality.max_depth));
        let least = own.quality.min_contribution.max(limit.quality.min_contribution);
        prop_assert_eq!(limited.quality.min_contribution, least);
        prop_assert_eq!(limited.samples, own.samples.min(limit.samples));
        let restored = own.restored();
        prop_assert_eq!(restored.at_most(&own), own);
        prop_assert_eq!(restored.restored(), restored);
    }
}
