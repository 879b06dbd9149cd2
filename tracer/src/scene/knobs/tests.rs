//! The table against the values that it describes.

use std::collections::BTreeSet;

use super::*;
use crate::scene::validate::{MAX_SAMPLES, is_sample_count};
use crate::texture::Filter;

fn all_off() -> SceneFeatures {
    SceneFeatures::default()
}

fn names(pick: fn(&Knob) -> &'static str) -> Vec<&'static str> {
    KNOBS.iter().map(pick).collect()
}

#[test]
fn knobs_have_their_names_keys_and_options() {
    let expected =
        ["samples", "scale", "adaptive", "shadows", "shading", "filter", "exponent", "colors", "dither"];
    assert_eq!(names(|knob| knob.name), expected);
    assert_eq!(names(|knob| knob.option), expected);
    let keys = expected.map(|name| if name == "colors" { "pixels" } else { name });
    assert_eq!(names(|knob| knob.key), keys);
}

#[test]
fn words_of_values_are_the_best_first() {
    let words = |name: &str| Knob::named(name).unwrap().words().collect::<Vec<_>>();
    assert_eq!(words("scale"), ["1", "3/4", "1/2", "1/3", "1/4"]);
    assert_eq!(words("adaptive"), ["off", "on"]);
    assert_eq!(words("shadows"), ["on", "off"]);
    assert_eq!(words("shading"), ["full", "diffuse"]);
    assert_eq!(words("filter"), ["bilinear", "nearest"]);
    assert_eq!(words("exponent"), ["exact", "fast"]);
    assert_eq!(words("colors"), ["exact", "reduced"]);
    assert_eq!(words("dither"), ["off", "on"]);
    let samples: Vec<u32> = words("samples").iter().map(|word| word.parse().unwrap()).collect();
    let all: Vec<u32> = (1..=MAX_SAMPLES).rev().filter(|count| is_sample_count(*count)).collect();
    assert_eq!(samples, all);
}

#[test]
fn every_value_is_found_again_in_a_setting_that_has_it() {
    let mut slugs = BTreeSet::new();
    for knob in KNOBS {
        for value in knob.values {
            let mut setting = Setting::FULL;
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
    assert_eq!(Setting::FULL.quality, Quality::default());
    assert!(Knob::named("no such knob").is_none());
}

#[test]
fn values_set_what_their_words_say() {
    let set = |name: &str, word: &str| {
        let mut setting = Setting::FULL;
        Knob::named(name).unwrap().value(word).unwrap().apply(&mut setting);
        setting
    };
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

/// The cheapest value of every knob, with several samples, so that all of them act.
fn cheapest() -> Setting {
    let mut setting = Setting::FULL;
    KNOBS.iter().for_each(|knob| knob.values[0].apply(&mut setting));
    Setting { samples: 4, ..setting }
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
fn knobs_that_make_no_difference_are_left_at_their_best() {
    let setting = cheapest().without_idle(&all_off());
    let Quality { shadows, adaptive, shading, filter, exponent, colors, dither, .. } = setting.quality;
    assert_eq!((shadows, shading, filter), (true, Shading::Full, None));
    assert_eq!((exponent, colors), (ExponentPrecision::Exact, ColorDepth::Reduced));
    assert!(adaptive && dither && setting.scale == RenderScale::Quarter);
    let glossy = SceneFeatures { specular: true, powers: true, shadows: true, ..all_off() };
    let setting = cheapest().without_idle(&glossy);
    assert_eq!(setting.quality.shading, Shading::Diffuse);
    assert_eq!(setting.quality.exponent, ExponentPrecision::Exact, "no highlight has an exponent any more");
    assert!(!setting.quality.shadows);
    let one = Setting { samples: 1, ..cheapest() }.without_idle(&glossy);
    assert!(!one.quality.adaptive, "one sample leaves nothing to adapt");
}

#[test]
fn reductions_are_labelled() {
    assert_eq!(Setting::FULL.reductions(), [""; 0]);
    let expected = [
        "scale 1/4",
        "adaptive samples",
        "no shadows",
        "diffuse only",
        "nearest texels",
        "fast exponent",
        "16-bit colours",
    ];
    assert_eq!(cheapest().reductions(), expected);
    let one = Setting { samples: 1, ..cheapest() };
    assert!(!one.reductions().contains(&"adaptive samples"));
}
