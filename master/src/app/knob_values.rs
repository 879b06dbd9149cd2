//! Values of knobs as text, on command lines and in control commands.

use rayfarm_tracer::scene::knobs::{GivenValue, Knob, KnobForm, NumberRange};

/// Words of a switch.
pub(crate) const SWITCH: [&str; 2] = ["on", "off"];

/// The value of a knob that a text names.
///
/// # Errors
/// The values that were expected.
pub(crate) fn parse(knob: &'static Knob, text: &str) -> Result<GivenValue, String> {
    match knob.form {
        KnobForm::Count(range) | KnobForm::Number(range) => number(range, text),
        KnobForm::Switch | KnobForm::Word | KnobForm::Fraction => {
            let words = words(knob);
            let value = words.contains(&text).then(|| knob.value(text)).flatten();
            let expected = || format!("expected one of {}", words.join(", "));
            value.map(GivenValue::Listed).ok_or_else(expected)
        }
    }
}

/// All words and aliases that a knob accepts.
pub(crate) fn words(knob: &'static Knob) -> Vec<&'static str> {
    match knob.form {
        KnobForm::Switch => SWITCH.to_vec(),
        KnobForm::Word | KnobForm::Fraction | KnobForm::Count(_) | KnobForm::Number(_) => {
            let values = knob.values.iter().rev().chain(knob.apart);
            values.flat_map(|value| value.word.iter().chain(value.aliases).copied()).collect()
        }
    }
}

/// A number of a range; whole ones may have leading zeros.
fn number(range: &'static NumberRange, text: &str) -> Result<GivenValue, String> {
    let parsed: Option<f64> =
        if range.whole { text.parse::<u32>().ok().map(f64::from) } else { text.parse().ok() };
    let number = parsed.filter(|number| range.contains(*number));
    number.map(|number| GivenValue::Number(range, number as f32)).ok_or_else(|| {
        let kind = if range.whole { "whole number" } else { "number" };
        format!("expected a {kind} from {} to {}", range.least, range.most)
    })
}
