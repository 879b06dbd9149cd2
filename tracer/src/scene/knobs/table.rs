//! The table of knobs.

use super::number::Order;
use super::{
    ColorDepth, ExponentPrecision, Knob, KnobForm, KnobScope, KnobValue, NumberRange, RenderScale, Setting,
    Shading,
};
use crate::scene::data::{Integrator, PathSettings, Sampler};
use crate::scene::validate::{MAX_CLAMP, MAX_DEPTH, MAX_PATH_SAMPLES, MAX_SHADOW_SAMPLES};
use crate::texture::Filter;

/// All knobs, in the order in which reports list them.
pub static KNOBS: &[Knob] = &[
    Knob {
        name: "samples",
        key: "samples",
        option: "samples",
        summary: "Rays per pixel: 1, 4, 9, 16, ... 256; with the path integrator any number up to 65536.",
        form: KnobForm::Count(&NumberRange {
            least: 1.0,
            most: MAX_PATH_SAMPLES as f32,
            whole: true,
            order: Order::Rises,
            get: |s| s.samples as f32,
            set: |s, number| s.samples = number as u32,
            label: None,
        }),
        values: SAMPLE_COUNTS,
        apart: &[],
        reduces: true,
        scope: KnobScope::All,
        acts: |_| true,
        matters: |_, _| true,
    },
    Knob {
        name: "scale",
        key: "scale",
        option: "scale",
        summary: "The share of width and height that is rendered, to be enlarged by the master.",
        form: KnobForm::Fraction,
        values: &[
            reduced("1/4", "scale 1/4", "scale-1-4", |s| s.scale = RenderScale::Quarter)
                .with_aliases(&["0.25"]),
            reduced("1/3", "scale 1/3", "scale-1-3", |s| s.scale = RenderScale::Third),
            reduced("1/2", "scale 1/2", "scale-1-2", |s| s.scale = RenderScale::Half).with_aliases(&["0.5"]),
            reduced("3/4", "scale 3/4", "scale-3-4", |s| s.scale = RenderScale::ThreeQuarters)
                .with_aliases(&["0.75"]),
            usual("1", |s| s.scale = RenderScale::Full),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::All,
        acts: |_| true,
        matters: |_, _| true,
    },
    Knob {
        name: "adaptive",
        key: "adaptive",
        option: "adaptive",
        summary: "All samples only where neighbours differ, few elsewhere.",
        form: KnobForm::Switch,
        values: &[
            reduced("on", "adaptive samples", "adaptive", |s| s.quality.adaptive = true),
            usual("off", |s| s.quality.adaptive = false),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::Direct,
        acts: |setting| setting.samples > 1,
        matters: |_, setting| setting.samples > 1,
    },
    Knob {
        name: "shadows",
        key: "shadows",
        option: "shadows",
        summary: "Whether lights cast shadows.",
        form: KnobForm::Switch,
        values: &[
            reduced("off", "no shadows", "no-shadows", |s| s.quality.shadows = false),
            usual("on", |s| s.quality.shadows = true),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::Direct,
        acts: shows_light,
        matters: |features, _| features.shadows,
    },
    Knob {
        name: "shadow_samples",
        key: "shadow_samples",
        option: "shadow-samples",
        summary: "Points of a light with a radius that shadow rays go to, from 1 to 1024.",
        form: KnobForm::Number(&NumberRange {
            least: 1.0,
            most: MAX_SHADOW_SAMPLES as f32,
            whole: true,
            order: Order::Rises,
            get: |s| f32::from(s.quality.shadow_samples),
            set: |s, number| s.quality.shadow_samples = number as u16,
            label: Some(|number| format!("{number} shadow sample{}", if number == 1.0 { "" } else { "s" })),
        }),
        values: &[
            fewer("1", "shadow-samples-1", |s| s.quality.shadow_samples = 1),
            fewer("4", "shadow-samples-4", |s| s.quality.shadow_samples = 4),
            fewer("9", "shadow-samples-9", |s| s.quality.shadow_samples = 9),
            usual("16", |s| s.quality.shadow_samples = 16),
            usual("25", |s| s.quality.shadow_samples = 25),
            usual("36", |s| s.quality.shadow_samples = 36),
            usual("64", |s| s.quality.shadow_samples = 64),
            usual("256", |s| s.quality.shadow_samples = 256),
            usual("1024", |s| s.quality.shadow_samples = MAX_SHADOW_SAMPLES),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::Direct,
        acts: |setting| shows_light(setting) && setting.quality.shadows,
        matters: |features, setting| features.soft_shadows && setting.quality.shadows,
    },
    Knob {
        name: "terminator",
        key: "smooth_terminator",
        option: "smooth-terminator",
        summary: "Whether shadow rays of smooth meshes start on the smooth surface, or on its triangles.",
        form: KnobForm::Switch,
        values: &[
            reduced("off", "hard terminator", "hard-terminator", |s| s.quality.smooth_terminator = false),
            usual("on", |s| s.quality.smooth_terminator = true),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::Direct,
        acts: |setting| shows_light(setting) && setting.quality.shadows,
        matters: |features, setting| features.smooth && features.shadows && setting.quality.shadows,
    },
    Knob {
        name: "shading",
        key: "shading",
        option: "shading",
        summary: "The terms of the shading: all, or without highlights; or a picture of something else than light.",
        form: KnobForm::Word,
        values: &[
            reduced("diffuse", "diffuse only", "diffuse", |s| s.quality.shading = Shading::Diffuse),
            usual("full", |s| s.quality.shading = Shading::Full),
        ],
        apart: &[
            usual("normals", |s| s.quality.shading = Shading::Normals),
            usual("depth", |s| s.quality.shading = Shading::Depth),
            usual("item", |s| s.quality.shading = Shading::Item),
            usual("albedo", |s| s.quality.shading = Shading::Albedo),
        ],
        reduces: true,
        scope: KnobScope::All,
        acts: |_| true,
        matters: |features, setting| {
            !shows_light(setting) || (features.specular && setting.integrator == Integrator::Direct)
        },
    },
    Knob {
        name: "depth",
        key: "max_depth",
        option: "max-depth",
        summary: "The largest number of reflections and transmissions of a ray, or of bounces of a path, from 0 to 64.",
        form: KnobForm::Number(&NumberRange {
            least: 0.0,
            most: MAX_DEPTH as f32,
            whole: true,
            order: Order::Rises,
            get: |s| f32::from(s.quality.max_depth),
            set: |s, number| s.quality.max_depth = number as u8,
            label: Some(|number| format!("depth {number}")),
        }),
        values: &[
            fewer("0", "depth-0", |s| s.quality.max_depth = 0),
            fewer("1", "depth-1", |s| s.quality.max_depth = 1),
            fewer("2", "depth-2", |s| s.quality.max_depth = 2),
            fewer("3", "depth-3", |s| s.quality.max_depth = 3),
            fewer("5", "depth-5", |s| s.quality.max_depth = 5),
            usual("8", |s| s.quality.max_depth = 8),
            usual("16", |s| s.quality.max_depth = 16),
            usual("64", |s| s.quality.max_depth = MAX_DEPTH),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::All,
        acts: shows_light,
        matters: |features, setting| features.bounces || setting.integrator.path().is_some(),
    },
    Knob {
        name: "min_contribution",
        key: "min_contribution",
        option: "min-contribution",
        summary: "A reflection or transmission that can add less than this, from 0 to 1, is not traced.",
        form: KnobForm::Number(&NumberRange {
            least: 0.0,
            most: 1.0,
            whole: false,
            order: Order::Falls,
            get: |s| s.quality.min_contribution,
            set: |s, number| s.quality.min_contribution = number,
            label: Some(|number| format!("contributions from {number}")),
        }),
        values: &[
            fewer("0.1", "contribution-0-1", |s| s.quality.min_contribution = 0.1),
            fewer("0.03", "contribution-0-03", |s| s.quality.min_contribution = 0.03),
            fewer("0.01", "contribution-0-01", |s| s.quality.min_contribution = 0.01),
            usual("0.004", |s| s.quality.min_contribution = 0.004),
            usual("0.001", |s| s.quality.min_contribution = 0.001),
            usual("0", |s| s.quality.min_contribution = 0.0),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::Direct,
        acts: |setting| shows_light(setting) && setting.quality.max_depth > 0,
        matters: |features, setting| features.bounces && setting.quality.max_depth > 0,
    },
    Knob {
        name: "sampler",
        key: "sampler",
        option: "sampler",
        summary: "The numbers of paths: evenly spread, or independent, which have more noise.",
        form: KnobForm::Word,
        values: &[
            reduced("independent", "independent samples", "independent", |s| {
                set_path(s, |paths| paths.sampler = Sampler::Independent);
            }),
            usual("sobol", |s| set_path(s, |paths| paths.sampler = Sampler::Sobol)),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::Paths,
        acts: shows_light,
        matters: |_, setting| shows_light(setting),
    },
    Knob {
        name: "roulette",
        key: "roulette",
        option: "roulette",
        summary: "Whether paths of little weight end early, at random: the mean of the picture does not change.",
        form: KnobForm::Switch,
        values: &[
            KnobValue {
                word: Some("off"),
                aliases: &[],
                label: None,
                slug: Some("no-roulette"),
                apply: |s| set_path(s, |paths| paths.roulette = false),
            },
            usual("on", |s| set_path(s, |paths| paths.roulette = true)),
        ],
        apart: &[],
        reduces: false,
        scope: KnobScope::Paths,
        acts: shows_light,
        matters: |_, setting| shows_light(setting),
    },
    Knob {
        name: "clamp_indirect",
        key: "clamp_indirect",
        option: "clamp-indirect",
        summary: "Largest radiance of a path's light that was scattered more than once; 0 is no limit.",
        form: KnobForm::Number(&NumberRange {
            least: 0.0,
            most: MAX_CLAMP,
            whole: false,
            order: Order::RisesToZero,
            get: |s| s.integrator.path().map_or(0.0, |paths| paths.clamp_indirect),
            set: |s, number| set_path(s, |paths| paths.clamp_indirect = number),
            label: Some(|number| format!("indirect light up to {number}")),
        }),
        values: &[
            fewer("1", "clamp-1", |s| set_path(s, |paths| paths.clamp_indirect = 1.0)),
            fewer("10", "clamp-10", |s| set_path(s, |paths| paths.clamp_indirect = 10.0)),
            usual("0", |s| set_path(s, |paths| paths.clamp_indirect = 0.0)),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::Paths,
        acts: shows_light,
        matters: |_, setting| shows_light(setting) && setting.quality.max_depth > 0,
    },
    Knob {
        name: "filter",
        key: "filter",
        option: "filter",
        summary: "How all textures are looked up; by default each as it is defined.",
        form: KnobForm::Word,
        values: &[
            reduced("nearest", "nearest texels", "nearest", |s| s.quality.filter = Some(Filter::Nearest)),
            reduced("bilinear", "bilinear texels", "bilinear", |s| s.quality.filter = Some(Filter::Bilinear)),
            reduced("trilinear", "trilinear texels", "trilinear", |s| {
                s.quality.filter = Some(Filter::Trilinear);
            }),
            KnobValue {
                word: None,
                aliases: &[],
                label: None,
                slug: None,
                apply: |s| s.quality.filter = None,
            },
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::All,
        acts: |setting| shows_light(setting) || setting.quality.shading == Shading::Albedo,
        matters: |features, _| features.filtered,
    },
    Knob {
        name: "exponent",
        key: "exponent",
        option: "exponent",
        summary: "How the highlights' power is computed.",
        form: KnobForm::Word,
        values: &[
            reduced("fast", "fast exponent", "fast-exponent", |s| {
                s.quality.exponent = ExponentPrecision::Fast;
            }),
            usual("exact", |s| s.quality.exponent = ExponentPrecision::Exact),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::Direct,
        acts: shows_light,
        matters: |features, setting| features.powers && setting.quality.shading == Shading::Full,
    },
    Knob {
        name: "colors",
        key: "pixels",
        option: "colors",
        summary: "The colours of pixels: RGB8, or 5, 6 and 5 bits, which is two bytes a pixel on the wire.",
        form: KnobForm::Word,
        values: &[
            reduced("reduced", "16-bit colours", "reduced-colors", |s| {
                s.quality.colors = ColorDepth::Reduced;
            }),
            usual("exact", |s| s.quality.colors = ColorDepth::Exact),
        ],
        apart: &[],
        reduces: true,
        scope: KnobScope::All,
        acts: |_| true,
        matters: |_, _| true,
    },
    Knob {
        name: "dither",
        key: "dither",
        option: "dither",
        summary: "Dither pixels where light becomes bytes: a fine pattern in place of bands in slow gradients.",
        form: KnobForm::Switch,
        values: &[
            KnobValue {
                word: Some("on"),
                aliases: &[],
                label: None,
                slug: Some("dither"),
                apply: |s| s.quality.dither = true,
            },
            usual("off", |s| s.quality.dither = false),
        ],
        apart: &[],
        reduces: false,
        scope: KnobScope::All,
        acts: |_| true,
        matters: |_, _| true,
    },
];

/// All sample counts of the direct integrator, and powers of two for paths.
const SAMPLE_COUNTS: &[KnobValue] = &[
    samples("1", "samples-1", |s| s.samples = 1),
    samples("2", "samples-2", |s| s.samples = 2),
    samples("4", "samples-4", |s| s.samples = 4),
    samples("8", "samples-8", |s| s.samples = 8),
    samples("9", "samples-9", |s| s.samples = 9),
    samples("16", "samples-16", |s| s.samples = 16),
    samples("25", "samples-25", |s| s.samples = 25),
    samples("32", "samples-32", |s| s.samples = 32),
    samples("36", "samples-36", |s| s.samples = 36),
    samples("49", "samples-49", |s| s.samples = 49),
    samples("64", "samples-64", |s| s.samples = 64),
    samples("81", "samples-81", |s| s.samples = 81),
    samples("100", "samples-100", |s| s.samples = 100),
    samples("121", "samples-121", |s| s.samples = 121),
    samples("128", "samples-128", |s| s.samples = 128),
    samples("144", "samples-144", |s| s.samples = 144),
    samples("169", "samples-169", |s| s.samples = 169),
    samples("196", "samples-196", |s| s.samples = 196),
    samples("225", "samples-225", |s| s.samples = 225),
    samples("256", "samples-256", |s| s.samples = 256),
    samples("512", "samples-512", |s| s.samples = 512),
    samples("1024", "samples-1024", |s| s.samples = 1024),
    samples("2048", "samples-2048", |s| s.samples = 2048),
    samples("4096", "samples-4096", |s| s.samples = 4096),
    samples("8192", "samples-8192", |s| s.samples = 8192),
    samples("16384", "samples-16384", |s| s.samples = 16384),
    samples("32768", "samples-32768", |s| s.samples = 32768),
    samples("65536", "samples-65536", |s| s.samples = 65536),
];

/// Changes the settings of the path integrator, if it is the one.
fn set_path(setting: &mut Setting, change: impl FnOnce(&mut PathSettings)) {
    if let Integrator::Path(settings) = &mut setting.integrator {
        change(settings);
    }
}

/// Whether the picture of a setting shows light.
fn shows_light(setting: &Setting) -> bool {
    setting.quality.shading.is_light()
}

/// A sample count. Reports give the number itself, so it has no label.
const fn samples(word: &'static str, slug: &'static str, apply: fn(&mut Setting)) -> KnobValue {
    KnobValue { word: Some(word), aliases: &[], label: None, slug: Some(slug), apply }
}

/// A value that reduces the accuracy.
const fn reduced(
    word: &'static str,
    label: &'static str,
    slug: &'static str,
    apply: fn(&mut Setting),
) -> KnobValue {
    KnobValue { word: Some(word), aliases: &[], label: Some(label), slug: Some(slug), apply }
}

/// A number below the default. Its short name is made of the number.
const fn fewer(word: &'static str, slug: &'static str, apply: fn(&mut Setting)) -> KnobValue {
    KnobValue { word: Some(word), aliases: &[], label: None, slug: Some(slug), apply }
}

/// A value that reduces nothing.
const fn usual(word: &'static str, apply: fn(&mut Setting)) -> KnobValue {
    KnobValue { word: Some(word), aliases: &[], label: None, slug: None, apply }
}

impl KnobValue {
    const fn with_aliases(self, aliases: &'static [&'static str]) -> Self {
        Self { aliases, ..self }
    }
}
