//! Values of the knobs in reports.

use rayfarm_tracer::scene::Setting;
use rayfarm_tracer::scene::knobs::{KNOBS, Knob, KnobForm};
use serde::{Serialize, Serializer};

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
    /// Values of a setting.
    pub(crate) fn of(setting: Setting) -> Self {
        Self(setting)
    }

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
    use rayfarm_tracer::scene::{ColorDepth, ExponentPrecision, Filter, Quality, RenderScale, Shading};

    use super::*;

    fn json(setting: Setting) -> String {
        serde_json::to_string(&Knobs::of(setting)).unwrap()
    }

    #[test]
    fn full_quality_is_reported() {
        assert_eq!(
            json(Setting::FULL),
            r#"{"scale":1.0,"adaptive":false,"shadows":true,"shading":"full","filter":null,"exponent":"exact","colors":"exact","dither":false}"#
        );
    }

    #[test]
    fn every_reduction_is_reported() {
        let quality = Quality {
            adaptive: true,
            shadows: false,
            shading: Shading::Diffuse,
            filter: Some(Filter::Nearest),
            exponent: ExponentPrecision::Fast,
            colors: ColorDepth::Reduced,
            dither: true,
            ..Quality::default()
        };
        assert_eq!(
            json(Setting { samples: 4, scale: RenderScale::Half, quality }),
            r#"{"scale":0.5,"adaptive":true,"shadows":false,"shading":"diffuse","filter":"nearest","exponent":"fast","colors":"reduced","dither":true}"#
        );
    }

    #[test]
    fn fractions_are_those_of_the_scales() {
        for scale in RenderScale::ALL {
            assert_eq!(fraction(scale.word()), Some(scale.factor()));
        }
        assert_eq!((fraction("1/"), fraction("wide")), (None, None));
    }
}
