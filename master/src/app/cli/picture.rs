//! The options that say what the picture is like, and what may be left out of it for speed.

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use rayfarm_tracer::scene::{ColorDepth, ExponentPrecision, Filter, Quality, RenderScale, Shading};

use super::values::{Size, degrees, sample_count, size};

/// What the picture is like; each wins over the scene file.
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
    /// The camera goes round its look-at point by this angle over the frames.
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_hyphen_values = true, value_parser = degrees)]
    pub(crate) orbit: f64,
    /// The models turn about y by this angle each frame.
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_hyphen_values = true, value_parser = degrees)]
    pub(crate) spin: f64,
}

/// What may be left out or done more roughly; each wins over the scene file.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(crate) struct QualityArgs {
    /// All samples only where neighbours differ, few elsewhere.
    #[arg(long, value_name = "on|off", num_args = 0..=1, require_equals = true, default_missing_value = "on",
        value_parser = one_of(&SWITCH))]
    adaptive: Option<bool>,
    /// Whether lights cast shadows.
    #[arg(long, value_name = "on|off", value_parser = one_of(&SWITCH))]
    shadows: Option<bool>,
    /// The terms of the shading: all, or without highlights.
    #[arg(long, value_name = "full|diffuse", value_parser = one_of(&Shading::WORDS))]
    shading: Option<Shading>,
    /// How all textures are looked up.
    #[arg(long, value_name = "nearest|bilinear", value_parser = one_of(&Filter::WORDS))]
    filter: Option<Filter>,
    /// How the highlights' power is computed.
    #[arg(long, value_name = "exact|fast", value_parser = one_of(&ExponentPrecision::WORDS))]
    exponent: Option<ExponentPrecision>,
    /// The colours of pixels: RGB8, or 5, 6 and 5 bits, which is two bytes a pixel on the wire.
    #[arg(long, value_name = "exact|reduced", value_parser = one_of(&ColorDepth::WORDS))]
    colors: Option<ColorDepth>,
    /// The part of width and height that is rendered, to be enlarged by the master.
    #[arg(long, value_name = "1|3/4|1/2|1/3|1/4", value_parser = one_of(&SCALES))]
    scale: Option<RenderScale>,
    /// Dither pixels where light becomes bytes: a fine pattern in place of bands in slow gradients.
    #[arg(long, value_name = "on|off", num_args = 0..=1, require_equals = true, default_missing_value = "on",
        value_parser = one_of(&SWITCH))]
    dither: Option<bool>,
}

impl QualityArgs {
    /// The knobs that the tracer knows, over those of the scene file.
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

    /// Whether it is said here that samples may be left out.
    pub(crate) fn asks_to_adapt(&self) -> bool {
        self.adaptive == Some(true)
    }

    /// The scale, over that of the scene file.
    pub(crate) fn scale_over(&self, scene: RenderScale) -> RenderScale {
        self.scale.unwrap_or(scene)
    }
}

const SWITCH: [(&str, bool); 2] = [("on", true), ("off", false)];

/// The decimals are how scene files write them.
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

/// One of a few words, and what it means.
pub(super) fn one_of<T: Copy + Send + Sync + 'static>(
    words: &'static [(&'static str, T)],
) -> impl TypedValueParser<Value = T> {
    let known = PossibleValuesParser::new(words.iter().map(|(word, _)| *word));
    known.try_map(move |text| {
        let found = words.iter().find(|(word, _)| *word == text).map(|(_, meaning)| *meaning);
        found.ok_or("this word is not known")
    })
}
