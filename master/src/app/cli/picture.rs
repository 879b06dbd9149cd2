//! Options of the picture: size, samples, quality and animation.

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use rayfarm_tracer::scene::{ColorDepth, ExponentPrecision, Filter, Quality, RenderScale, Shading};

use super::values::{Size, degrees, sample_count, size};

/// Size, samples, quality and animation; each overrides the scene file.
#[derive(Clone, Debug, Args)]
pub(crate) struct PictureArgs {
    /// Picture size in pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<Size>,
    /// Rays per pixel: a square number, 1, 4, 9, 16, ...
    #[arg(long, value_name = "N", value_parser = sample_count)]
    pub(crate) samples: Option<u32>,
    #[command(flatten)]
    pub(crate) quality: QualityArgs,
    /// Orbit the camera about its look-at point by this angle over all frames.
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_hyphen_values = true, value_parser = degrees)]
    pub(crate) orbit: f64,
    /// Rotate the models about y by this angle per frame.
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_hyphen_values = true, value_parser = degrees)]
    pub(crate) spin: f64,
}

/// Knobs of the quality; each overrides the scene file.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(crate) struct QualityArgs {
    /// Trace all samples only where neighbouring pixels differ, few elsewhere.
    #[arg(long, value_name = "on|off", num_args = 0..=1, require_equals = true, default_missing_value = "on",
        value_parser = one_of(&SWITCH))]
    adaptive: Option<bool>,
    /// Shadows of lights.
    #[arg(long, value_name = "on|off", value_parser = one_of(&SWITCH))]
    shadows: Option<bool>,
    /// Terms of the shading: all, or without highlights.
    #[arg(long, value_name = "full|diffuse", value_parser = one_of(&Shading::WORDS))]
    shading: Option<Shading>,
    /// Filter of all textures.
    #[arg(long, value_name = "nearest|bilinear", value_parser = one_of(&Filter::WORDS))]
    filter: Option<Filter>,
    /// Precision of the specular exponent.
    #[arg(long, value_name = "exact|fast", value_parser = one_of(&ExponentPrecision::WORDS))]
    exponent: Option<ExponentPrecision>,
    /// Colour depth of pixels: RGB8, or 5, 6 and 5 bits, which take two bytes per pixel on the wire.
    #[arg(long, value_name = "exact|reduced", value_parser = one_of(&ColorDepth::WORDS))]
    colors: Option<ColorDepth>,
    /// Scale of width and height at which the picture is rendered; the master enlarges it.
    #[arg(long, value_name = "1|3/4|1/2|1/3|1/4", value_parser = one_of(&SCALES))]
    scale: Option<RenderScale>,
    /// Dither pixels: a fine pattern in place of bands in smooth gradients.
    #[arg(long, value_name = "on|off", num_args = 0..=1, require_equals = true, default_missing_value = "on",
        value_parser = one_of(&SWITCH))]
    dither: Option<bool>,
}

impl QualityArgs {
    /// Knobs of the tracer, with those of the scene file as defaults.
    pub(crate) fn over(&self, scene: Quality) -> Quality {
        Quality {
            adaptive: self.adaptive.unwrap_or(scene.adaptive),
            shadows: self.shadows.unwrap_or(scene.shadows),
            shading: self.shading.unwrap_or(scene.shading),
            filter: self.filter.or(scene.filter),
            exponent: self.exponent.unwrap_or(scene.exponent),
            colors: self.colors.unwrap_or(scene.colors),
            dither: self.dither.unwrap_or(scene.dither),
        }
    }

    /// Whether `--adaptive` is given and on.
    pub(crate) fn is_adaptive(&self) -> bool {
        self.adaptive == Some(true)
    }

    /// Scale, with that of the scene file as default.
    pub(crate) fn scale_over(&self, scene: RenderScale) -> RenderScale {
        self.scale.unwrap_or(scene)
    }
}

const SWITCH: [(&str, bool); 2] = [("on", true), ("off", false)];

/// Words for scales; the decimals are those of scene files.
const SCALES: [(&str, RenderScale); 8] = [
    ("1", RenderScale::Full),
    ("3/4", RenderScale::ThreeQuarters),
    ("0.75", RenderScale::ThreeQuarters),
    ("1/2", RenderScale::Half),
    ("0.5", RenderScale::Half),
    ("1/3", RenderScale::Third),
    ("1/4", RenderScale::Quarter),
    ("0.25", RenderScale::Quarter),
];

/// Parser of one of a few words, with the meaning of each.
pub(super) fn one_of<T: Copy + Send + Sync + 'static>(
    words: &'static [(&'static str, T)],
) -> impl TypedValueParser<Value = T> {
    let known = PossibleValuesParser::new(words.iter().map(|(word, _)| *word));
    known.try_map(move |text| {
        let found = words.iter().find(|(word, _)| *word == text).map(|(_, meaning)| *meaning);
        found.ok_or("unknown word")
    })
}
