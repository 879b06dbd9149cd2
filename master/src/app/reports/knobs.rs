//! Values of the knobs in reports.

use rayfarm_tracer::scene::Setting;
use rayfarm_tracer::scene::knobs::{KNOBS, Knob, KnobForm, KnobScope};
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
    /// A whole number of a range.
    Whole(u32),
    /// A number of a range, in its shortest form.
    Number(f32),
}

impl Knobs {
    /// Values of a setting.
    pub(crate) fn of(setting: Setting) -> Self {
        Self(setting)
    }

    /// Whether the integrator has a knob. Knobs of the direct integrator are always reported.
    fn has(&self, knob: &Knob) -> bool {
        knob.scope != KnobScope::Paths || knob.has_effect_with(&self.0.integrator)
    }

    fn value(&self, knob: &Knob) -> Option<ReportedValue> {
        let word = knob.value_of(&self.0).word;
        match knob.form {
            KnobForm::Switch => Some(ReportedValue::Switch(word == Some("on"))),
            KnobForm::Fraction => Some(ReportedValue::Fraction(word.and_then(fraction))),
            KnobForm::Word => Some(ReportedValue::Word(word)),
            KnobForm::Number(range) if range.whole => Some(ReportedValue::Whole(range.of(&self.0) as u32)),
            KnobForm::Number(range) => Some(ReportedValue::Number(range.of(&self.0))),
            KnobForm::Count(_) => None,
        }
    }
}

impl Serialize for Knobs {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let knobs = KNOBS.iter().filter(|knob| self.has(knob));
        serializer.collect_map(knobs.filter_map(|knob| Some((knob.name, self.value(knob)?))))
    }
}

/// The number of a text such as `3/4` or `1`.
fn fraction(text: &str) -> Option<f64> {
    let (part, parts) = text.split_once('/').unwrap_or((text, "1"));
    Some(part.parse::<f64>().ok()? / parts.parse::<f64>().ok()?)
}

#[cfg(test)]
mod tests {
    use rayfarm_tracer::scene::{
        ColorDepth, ExponentPrecision, Filter, Integrator, PathSettings, Quality, RenderScale,
        RenderSettings, Shading,
    };

    use super::*;

    fn json(setting: Setting) -> String {
        serde_json::to_string(&Knobs::of(setting)).unwrap()
    }

    #[test]
    fn full_quality_is_reported() {
        assert_eq!(
            json(RenderSettings::default().setting()),
            concat!(
                r#"{"scale":1.0,"adaptive":false,"shadows":true,"shadow_samples":16,"terminator":true,"shading":"full","depth":5,"#,
                r#""min_contribution":0.004,"filter":null,"exponent":"exact","colors":"exact","dither":false}"#
            )
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
            max_depth: 7,
            min_contribution: 0.05,
            shadow_samples: 5,
            smooth_terminator: false,
        };
        assert_eq!(
            json(Setting { integrator: Integrator::Direct, samples: 4, scale: RenderScale::Half, quality }),
            concat!(
                r#"{"scale":0.5,"adaptive":true,"shadows":false,"shadow_samples":5,"terminator":false,"shading":"diffuse","depth":7,"#,
                r#""min_contribution":0.05,"filter":"nearest","exponent":"fast","colors":"reduced","dither":true}"#
            )
        );
    }

    #[test]
    fn pictures_without_light_are_reported() {
        let quality = Quality { shading: Shading::Normals, ..Quality::default() };
        let setting = Setting { quality, ..RenderSettings::default().setting() };
        assert!(json(setting).contains(r#""shading":"normals""#));
    }

    #[test]
    fn knobs_of_paths_are_reported_where_paths_are_traced() {
        let usual = Integrator::Path(PathSettings::DEFAULT);
        let report = json(RenderSettings::with_integrator(usual).setting());
        let of_paths = r#""sampler":"sobol","roulette":true,"clamp_indirect":0.0"#;
        assert!(report.contains(of_paths) && report.contains(r#""depth":8"#), "{report}");
        let clamped = PathSettings { clamp_indirect: 2.5, roulette: false, ..PathSettings::DEFAULT };
        let report = json(RenderSettings::with_integrator(Integrator::Path(clamped)).setting());
        assert!(report.contains(r#""roulette":false,"clamp_indirect":2.5"#), "{report}");
    }

    #[test]
    fn fractions_are_those_of_the_scales() {
        for scale in RenderScale::ALL {
            assert_eq!(fraction(scale.word()), Some(scale.factor()));
        }
        assert_eq!((fraction("1/"), fraction("wide")), (None, None));
    }
}
