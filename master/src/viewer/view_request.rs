//! View requests: a view and the quality of its picture, with the knobs as commands, displays and reports name them.

use rayfarm_tracer::image::{self, ImageError, RgbImage};
use rayfarm_tracer::scene::knobs::{KNOBS, Knob, KnobForm};
use rayfarm_tracer::scene::{FrameView, RenderScale, Setting};
use serde::{Serialize, Serializer};

/// A requested picture, and the scale at which the farm renders it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ViewRequest {
    /// Camera, knobs of the tracer, and the size in which the picture is delivered.
    pub(crate) view: FrameView,
    /// Rendered pixels per delivered pixel, along a side.
    pub(crate) scale: RenderScale,
}

impl ViewRequest {
    /// Sample count, scale and knobs.
    pub(crate) fn setting(&self) -> Setting {
        self.view.setting(self.scale)
    }

    /// The request with upper limits of its knobs. No knob is raised.
    pub(crate) fn at_most(&self, limit: &Setting) -> Self {
        let Setting { samples, scale, quality } = self.setting().at_most(limit);
        Self { view: FrameView { samples, quality, ..self.view }, scale }
    }

    /// The view that the farm renders.
    pub(crate) fn rendered(&self) -> FrameView {
        self.view.at(&self.setting())
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
        Knobs(self.setting())
    }

    /// Labels of all knobs that are not at full quality.
    pub(crate) fn reductions(&self) -> Vec<&'static str> {
        self.setting().reductions()
    }
}

/// Value of each knob except the number of samples, which reports have on its own. Serialises to a map by knob.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Knobs(Setting);

/// Value of a knob in JSON.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum ReportedValue {
    Switch(bool),
    /// Rendered pixels per pixel along a side.
    Fraction(Option<f64>),
    /// `null` for the value that has no word.
    Word(Option<&'static str>),
}

impl Knobs {
    fn value(&self, knob: &Knob) -> Option<ReportedValue> {
        let word = knob.value_of(&self.0).word;
        match knob.form {
            KnobForm::Switch => Some(ReportedValue::Switch(word == Some("on"))),
            KnobForm::Fraction => Some(ReportedValue::Fraction(word.and_then(fraction))),
            KnobForm::Word => Some(ReportedValue::Word(word)),
            KnobForm::Count => None,
        }
    }
}

impl Serialize for Knobs {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(KNOBS.iter().filter_map(|knob| Some((knob.name, self.value(knob)?))))
    }
}

/// The number of a text such as `3/4` or `1`.
fn fraction(text: &str) -> Option<f64> {
    let (part, parts) = text.split_once('/').unwrap_or((text, "1"));
    Some(part.parse::<f64>().ok()? / parts.parse::<f64>().ok()?)
}

#[cfg(test)]
mod tests {
    use rayfarm_tracer::scene::{ColorDepth, ExponentPrecision, Filter, Quality, Shading};

    use super::*;
    use crate::test_scene;

    fn full() -> ViewRequest {
        ViewRequest { view: test_scene::view(), scale: RenderScale::Full }
    }

    #[test]
    fn full_quality_has_no_reductions() {
        assert_eq!(full().reductions(), [""; 0]);
        assert_eq!(full().rendered(), test_scene::view());
        assert_eq!(
            serde_json::to_string(&full().knobs()).unwrap(),
            r#"{"scale":1.0,"adaptive":false,"shadows":true,"shading":"full","filter":null,"exponent":"exact","colors":"exact","dither":false}"#
        );
    }

    #[test]
    fn fractions_are_those_of_the_scales() {
        for scale in RenderScale::ALL {
            assert_eq!(fraction(scale.word()), Some(scale.factor()));
        }
        assert_eq!((fraction("1/"), fraction("wide")), (None, None));
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
            r#"{"scale":0.5,"adaptive":true,"shadows":false,"shading":"diffuse","filter":"nearest","exponent":"fast","colors":"reduced","dither":true}"#
        );
        let (rendered, view) = (wanted.rendered(), wanted.view);
        assert_eq!((rendered.width, rendered.height), (view.width / 2, view.height / 2));
        assert_eq!(FrameView { width: view.width, height: view.height, ..rendered }, view);
        let picture = RgbImage::new(rendered.width, rendered.height);
        assert_eq!(wanted.delivered(picture).unwrap(), RgbImage::new(view.width, view.height));
    }
}
