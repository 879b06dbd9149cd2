//! View requests: a view and the quality of its picture, with the knobs as commands, displays and reports name them.

use rayfarm_tracer::image::{self, ImageError, RgbImage};
use rayfarm_tracer::scene::knobs::word_of;
use rayfarm_tracer::scene::{
    ColorDepth, ExponentPrecision, Filter, FrameView, Quality, RenderScale, Shading,
};
use serde::Serialize;

/// A requested picture, and the scale at which the farm renders it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ViewRequest {
    /// Camera, knobs of the tracer, and the size in which the picture is delivered.
    pub(crate) view: FrameView,
    /// Rendered pixels per delivered pixel, along a side.
    pub(crate) scale: RenderScale,
}

impl ViewRequest {
    /// The view that the farm renders.
    pub(crate) fn rendered(&self) -> FrameView {
        let (width, height) = self.size();
        FrameView { width, height, ..self.view }
    }

    /// Width and height of the rendered picture, in pixels.
    fn size(&self) -> (u32, u32) {
        (self.scale.of(self.view.width), self.scale.of(self.view.height))
    }

    /// Resizes a rendered picture to the size in which it is delivered.
    ///
    /// # Errors
    /// A picture whose bytes do not fit its size.
    pub(crate) fn delivered(&self, rendered: RgbImage) -> Result<RgbImage, ImageError> {
        image::resize(rendered, self.view.width, self.view.height)
    }

    /// Values of all knobs, for reports.
    pub(crate) fn knobs(&self) -> Knobs {
        let Quality { adaptive, shadows, shading, filter, exponent, colors, dither } = self.view.quality;
        Knobs {
            shadows,
            shading: word_of(&Shading::WORDS, &shading),
            filter: filter.map(|filter| word_of(&Filter::WORDS, &filter)),
            exponent: word_of(&ExponentPrecision::WORDS, &exponent),
            colors: word_of(&ColorDepth::WORDS, &colors),
            scale: self.scale.factor(),
            adaptive,
            dither,
        }
    }

    /// A short text for each knob that is not at full quality.
    pub(crate) fn reductions(&self) -> Vec<String> {
        // Dither is no reduction.
        let Quality { adaptive: _, shadows, shading, filter, exponent, colors, dither: _ } =
            self.view.quality;
        let mut reductions = Vec::new();
        let mut name = |reduced: bool, words: &str| {
            if reduced {
                reductions.push(words.to_owned());
            }
        };
        name(self.scale != RenderScale::Full, &format!("scale {}", self.scale.word()));
        name(self.view.is_adaptive(), "adaptive samples");
        name(!shadows, "no shadows");
        name(shading == Shading::Diffuse, "diffuse only");
        name(filter == Some(Filter::Nearest), "nearest texels");
        name(filter == Some(Filter::Bilinear), "bilinear texels");
        name(exponent == ExponentPrecision::Fast, "fast exponent");
        name(colors == ColorDepth::Reduced, "16-bit colours");
        reductions
    }
}

/// Value of each knob, in the words of the command line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Knobs {
    shadows: bool,
    shading: &'static str,
    /// `null` where each texture has its own filter.
    filter: Option<&'static str>,
    exponent: &'static str,
    colors: &'static str,
    /// Rendered pixels per pixel along a side.
    scale: f64,
    adaptive: bool,
    dither: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene;

    fn full() -> ViewRequest {
        ViewRequest { view: test_scene::view(), scale: RenderScale::Full }
    }

    #[test]
    fn full_quality_has_no_reductions() {
        assert_eq!(full().reductions(), Vec::<String>::new());
        assert_eq!(full().rendered(), test_scene::view());
        assert_eq!(
            serde_json::to_string(&full().knobs()).unwrap(),
            r#"{"shadows":true,"shading":"full","filter":null,"exponent":"exact","colors":"exact","scale":1.0,"adaptive":false,"dither":false}"#
        );
    }

    #[test]
    fn every_reduction_is_named_and_reported() {
        let mut wanted = ViewRequest { scale: RenderScale::Half, ..full() };
        wanted.view.samples = 4;
        wanted.view.quality = Quality {
            adaptive: true,
            shadows: false,
            shading: Shading::Diffuse,
            filter: Some(Filter::Nearest),
            exponent: ExponentPrecision::Fast,
            colors: ColorDepth::Reduced,
            dither: true,
        };
        let expected = [
            "scale 1/2",
            "adaptive samples",
            "no shadows",
            "diffuse only",
            "nearest texels",
            "fast exponent",
            "16-bit colours",
        ];
        assert_eq!(wanted.reductions(), expected);
        assert_eq!(
            serde_json::to_string(&wanted.knobs()).unwrap(),
            r#"{"shadows":false,"shading":"diffuse","filter":"nearest","exponent":"fast","colors":"reduced","scale":0.5,"adaptive":true,"dither":true}"#
        );
        let (rendered, view) = (wanted.rendered(), wanted.view);
        assert_eq!((rendered.width, rendered.height), (view.width / 2, view.height / 2));
        assert_eq!(FrameView { width: view.width, height: view.height, ..rendered }, view);
        let picture = RgbImage::new(rendered.width, rendered.height);
        assert_eq!(wanted.delivered(picture).unwrap(), RgbImage::new(view.width, view.height));
    }
}
