//! The table of knobs.

use super::{
    ColorDepth, ExponentPrecision, Knob, KnobForm, KnobValue, NumberRange, RenderScale, Setting, Shading,
};
use crate::scene::validate::{MAX_DEPTH, MAX_SHADOW_SAMPLES};
use crate::texture::Filter;

/// All knobs, in the order in which reports list them.
pub static KNOBS: &[Knob] = &[
    Knob {
        name: "samples",
        key: "samples",
        option: "samples",
        summary: "Rays per pixel: a square number, 1, 4, 9, 16, ...",
        form: KnobForm::Count,
        values: SAMPLE_COUNTS,
        apart: &[],
        reduces: true,
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
            rises: true,
            get: |s| f32::from(s.quality.shadow_samples),
            set: |s, number| s.quality.shadow_samples = number as u16,
            label: |number| format!("{number} shadow sample{}", if number == 1.0 { "" } else { "s" }),
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
        acts: |_| true,
        matters: |features, setting| features.specular || !shows_light(setting),
    },
    Knob {
        name: "depth",
        key: "max_depth",
        option: "max-depth",
        summary: "The largest number of reflections and transmissions of a ray, from 0 to 64.",
        form: KnobForm::Number(&NumberRange {
            least: 0.0,
            most: MAX_DEPTH as f32,
            whole: true,
            rises: true,
            get: |s| f32::from(s.quality.max_depth),
            set: |s, number| s.quality.max_depth = number as u8,
            label: |number| format!("depth {number}"),
        }),
        values: &[
            fewer("0", "depth-0", |s| s.quality.max_depth = 0),
            fewer("1", "depth-1", |s| s.quality.max_depth = 1),
            fewer("2", "depth-2", |s| s.quality.max_depth = 2),
            fewer("3", "depth-3", |s| s.quality.max_depth = 3),
            usual("5", |s| s.quality.max_depth = 5),
            usual("8", |s| s.quality.max_depth = 8),
            usual("16", |s| s.quality.max_depth = 16),
            usual("64", |s| s.quality.max_depth = MAX_DEPTH),
        ],
        apart: &[],
        reduces: true,
        acts: shows_light,
        matters: |features, _| features.bounces,
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
            rises: false,
            get: |s| s.quality.min_contribution,
            set: |s, number| s.quality.min_contribution = number,
            label: |number| format!("contributions from {number}"),
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
        acts: |setting| shows_light(setting) && setting.quality.max_depth > 0,
        matters: |features, setting| features.bounces && setting.quality.max_depth > 0,
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
        acts: |_| true,
        matters: |_, _| true,
    },
];

/// All sample counts up to [`crate::scene::MAX_SAMPLES`].
const SAMPLE_COUNTS: &[KnobValue] = &[
    samples("1", "samples-1", |s| s.samples = 1),
    samples("4", "samples-4", |s| s.samples = 4),
    samples("9", "samples-9", |s| s.samples = 9),
    samples("16", "samples-16", |s| s.samples = 16),
    samples("25", "samples-25", |s| s.samples = 25),
    samples("36", "samples-36", |s| s.samples = 36),
    samples("49", "samples-49", |s| s.samples = 49),
    samples("64", "samples-64", |s| s.samples = 64),
    samples("81", "samples-81", |s| s.samples = 81),
    samples("100", "samples-100", |s| s.samples = 100),
    samples("121", "samples-121", |s| s.samples = 121),
    samples("144", "samples-144", |s| s.samples = 144),
    samples("169", "samples-169", |s| s.samples = 169),
    samples("196", "samples-196", |s| s.samples = 196),
    samples("225", "samples-225", |s| s.samples = 225),
    samples("256", "samples-256", |s| s.samples = 256),
];

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
