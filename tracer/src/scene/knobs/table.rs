//! The table of knobs.

use super::{ColorDepth, ExponentPrecision, Knob, KnobForm, KnobValue, RenderScale, Setting, Shading};
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
        reduces: true,
        acts: |_| true,
        matters: |features, _| features.shadows,
    },
    Knob {
        name: "shading",
        key: "shading",
        option: "shading",
        summary: "The terms of the shading: all, or without highlights.",
        form: KnobForm::Word,
        values: &[
            reduced("diffuse", "diffuse only", "diffuse", |s| s.quality.shading = Shading::Diffuse),
            usual("full", |s| s.quality.shading = Shading::Full),
        ],
        reduces: true,
        acts: |_| true,
        matters: |features, _| features.specular,
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
            KnobValue {
                word: None,
                aliases: &[],
                label: None,
                slug: None,
                apply: |s| s.quality.filter = None,
            },
        ],
        reduces: true,
        acts: |_| true,
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
        reduces: true,
        acts: |_| true,
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

/// The value at full quality.
const fn usual(word: &'static str, apply: fn(&mut Setting)) -> KnobValue {
    KnobValue { word: Some(word), aliases: &[], label: None, slug: None, apply }
}

impl KnobValue {
    const fn with_aliases(self, aliases: &'static [&'static str]) -> Self {
        Self { aliases, ..self }
    }
}
