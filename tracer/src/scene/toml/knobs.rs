//! The knobs of `[render]`, read by a loop over the table of knobs.

use super::Reading;
use super::fault::{Fault, Read};
use super::table::Table;
use super::value::Value;
use crate::scene::data::{Integrator, RenderScale, Setting};
use crate::scene::knobs::{GivenValue, KNOBS, Knob, KnobForm, KnobValue, NumberRange, Shading};
use crate::scene::validate::is_sample_count;

/// Reads the knobs of a `[render]` table; a missing key keeps its value of `default`. Knobs without an effect with the integrator
/// are warned about.
///
/// # Errors
/// A value that the knob does not have; `adaptive = true` with one sample per pixel and the direct integrator.
pub(super) fn setting(table: Table<'_>, default: Setting, reading: &mut Reading) -> Read<Setting> {
    let mut setting = default;
    for knob in KNOBS {
        if let Some(value) = table.get(knob.key) {
            read(knob, value, &default.integrator)?.apply(&mut setting);
            if !knob.has_effect_with(&default.integrator) {
                reading.idle(table, knob.key, with(&default.integrator));
            }
        }
    }
    let is_direct = default.integrator == Integrator::Direct;
    if !is_direct && setting.quality.shading == Shading::Diffuse {
        reading.idle(table, "shading", "at \"diffuse\" with the path integrator, which has no such terms");
    }
    let nothing = is_direct && setting.quality.adaptive && setting.samples == 1;
    match table.get("adaptive").filter(|_| nothing) {
        Some(value) => Err(nothing_to_adapt(&value)),
        None => Ok(setting),
    }
}

/// The reason why a key has no effect with an integrator.
pub(super) fn with(integrator: &Integrator) -> &'static str {
    match integrator {
        Integrator::Direct => "with the direct integrator",
        Integrator::Path(_) => "with the path integrator",
    }
}

fn nothing_to_adapt(value: &Value<'_>) -> Fault {
    value.fault(
        "`adaptive = true` leaves out samples, but there is only one a pixel: set `samples` to 4, 9, 16, ...",
    )
}

/// The value of a knob, written in the knob's form.
fn read(knob: &'static Knob, value: Value<'_>, integrator: &Integrator) -> Read<GivenValue> {
    let listed = match knob.form {
        KnobForm::Switch => find(knob, value, if value.boolean()? { "on" } else { "off" }),
        KnobForm::Word => word(knob, value),
        KnobForm::Count(range) => return count(range, value, integrator),
        KnobForm::Fraction => fraction(knob, value),
        KnobForm::Number(range) => return number(range, value),
    };
    listed.map(GivenValue::Listed)
}

/// A number of a range.
fn number(range: &'static NumberRange, value: Value<'_>) -> Read<GivenValue> {
    let expected = format!("from {} to {}", range.least, range.most);
    let number = if range.whole {
        f64::from(value.whole(&expected, range.whole_numbers())?)
    } else {
        value.number(&expected, |number| range.contains(number))?
    };
    Ok(GivenValue::Number(range, number as f32))
}

/// The value of a knob with this word.
fn find(knob: &'static Knob, value: Value<'_>, word: &str) -> Read<&'static KnobValue> {
    knob.value(word).ok_or_else(|| {
        let words: Vec<&str> = knob.words().collect();
        value.must_be(&format!("one of {}", words.join(", ")))
    })
}

fn word(knob: &'static Knob, value: Value<'_>) -> Read<&'static KnobValue> {
    let words: Vec<_> = knob.words().filter_map(|word| Some((word, knob.value(word)?))).collect();
    value.word(&words)
}

/// A sample count.
fn count(range: &'static NumberRange, value: Value<'_>, integrator: &Integrator) -> Read<GivenValue> {
    let expected = match integrator {
        Integrator::Direct => "that is a square from 1 to 256 (1, 4, 9, 16, ...)",
        Integrator::Path(_) => "from 1 to 65536",
    };
    let samples = value.whole(expected, range.whole_numbers())?;
    let fits = is_sample_count(integrator, samples).then_some(GivenValue::Number(range, samples as f32));
    fits.ok_or_else(|| value.must_be(&format!("a whole number {expected}")))
}

/// A scale, as a number or as a fraction in quotes.
fn fraction(knob: &'static Knob, value: Value<'_>) -> Read<&'static KnobValue> {
    if value.value.get_ref().is_str() {
        return word(knob, value);
    }
    let expected = "that is 1, 0.75, 0.5 or 0.25, or one of \"3/4\", \"1/2\", \"1/3\", \"1/4\"";
    let known = |number: f64| RenderScale::ALL.into_iter().find(|scale| is_written(*scale, number));
    let number = value.number(expected, |number| known(number).is_some())?;
    let scale = known(number).ok_or_else(|| value.must_be(&format!("a number {expected}")))?;
    find(knob, value, scale.word())
}

/// Whether a number means a scale. One third has infinitely many digits, so two of them are enough.
fn is_written(scale: RenderScale, number: f64) -> bool {
    match scale {
        RenderScale::Third => (number - scale.factor()).abs() < 0.0034,
        _ => number == scale.factor(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{place, read};
    use super::*;
    use crate::scene::data::{ColorDepth, ExponentPrecision, Quality, RenderSettings, Shading};
    use crate::texture::Filter;

    fn render(keys: &str) -> Result<RenderSettings, String> {
        let text = format!("[render]\n{keys}");
        read(&text, 0.0).map(|scene| scene.render).map_err(|fault| {
            let (line, column) = place(&text, fault.at);
            format!("{line}:{column} {}", fault.message)
        })
    }

    #[test]
    fn every_knob_is_read() {
        let all = "samples = 4\nadaptive = true\nshadows = false\nshading = \"diffuse\"\nfilter = \"nearest\"\nexponent = \"fast\"\n\
                   pixels = \"reduced\"\nscale = 0.75\ndither = true\nmax_depth = 7\nmin_contribution = 0.02\nshadow_samples = 5\n\
                   smooth_terminator = false";
        let reduced = Quality {
            shadows: false,
            adaptive: true,
            shading: Shading::Diffuse,
            filter: Some(Filter::Nearest),
            exponent: ExponentPrecision::Fast,
            colors: ColorDepth::Reduced,
            dither: true,
            max_depth: 7,
            min_contribution: 0.02,
            shadow_samples: 5,
            smooth_terminator: false,
        };
        let render_all = render(all).unwrap();
        assert_eq!((render_all.quality, render_all.scale), (reduced, RenderScale::ThreeQuarters));
        let full = "adaptive = false\nshadows = true\nshading = \"full\"\nexponent = \"exact\"\npixels = \"exact\"\nscale = 1\ndither = false\n\
                    max_depth = 5\nmin_contribution = 0.004\nshadow_samples = 16\nsmooth_terminator = true";
        assert_eq!(render(full), render(""));
        assert_eq!(render("").unwrap().quality, Quality::default());
        assert_eq!(render("scale = 0.5").unwrap().scale, RenderScale::Half);
        assert_eq!(render("scale = 1.0").unwrap().scale, RenderScale::Full);
        for third in ["0.33", "0.333", "0.3333333333333333", "\"1/3\""] {
            assert_eq!(render(&format!("scale = {third}")).unwrap().scale, RenderScale::Third, "{third}");
        }
        for (word, scale) in RenderScale::WORDS {
            assert_eq!(render(&format!("scale = \"{word}\"")).unwrap().scale, scale);
        }
        assert_eq!(render("scale = 0.25").unwrap().scale, RenderScale::Quarter);
    }

    #[test]
    fn other_values_are_refused_with_their_place() {
        for (key, place, words) in [
            ("adaptive = true", "2:12 ", "set `samples` to 4, 9"),
            ("adaptive = 4", "2:12 ", "true or false, but is 4"),
            ("shadows = \"off\"", "2:11 ", "true or false, but is \"off\""),
            ("shading = \"difuse\"", "2:11 ", "did you mean `diffuse`?"),
            ("filter = \"linear\"", "2:10 ", "did you mean `bilinear`?"),
            ("exponent = \"exat\"", "2:12 ", "did you mean `exact`?"),
            ("exponent = 3", "2:12 ", "one of \"exact\", \"fast\", but is 3"),
            ("pixels = \"565\"", "2:10 ", "known here: `exact`, `reduced`"),
            (
                "scale = 2",
                "2:9 ",
                "that is 1, 0.75, 0.5 or 0.25, or one of \"3/4\", \"1/2\", \"1/3\", \"1/4\", but is 2",
            ),
            ("scale = nan", "2:9 ", "but is nan"),
            ("scale = 0.3", "2:9 ", "but is 0.3"),
            ("scale = \"1/5\"", "2:9 ", "did you mean `1/2`?"),
            ("max_depth = 65", "2:13 ", "a whole number from 0 to 64, but is 65"),
            ("max_depth = 1.0", "2:13 ", "a whole number from 0 to 64, but is 1.0"),
            ("max_depth = -1", "2:13 ", "a whole number from 0 to 64, but is -1"),
            ("min_contribution = 1.5", "2:20 ", "a number from 0 to 1, but is 1.5"),
            ("min_contribution = nan", "2:20 ", "a number from 0 to 1, but is nan"),
            ("shadow_samples = 0", "2:18 ", "a whole number from 1 to 1024, but is 0"),
            ("shadow_samples = \"all\"", "2:18 ", "a whole number from 1 to 1024, but is \"all\""),
            ("smooth_terminator = 1", "2:21 ", "true or false, but is 1"),
            ("shading = \"normal\"", "2:11 ", "did you mean `normals`?"),
            ("scael = 1", "2:1 ", "did you mean `scale`?"),
        ] {
            let message = render(key).unwrap_err();
            assert!(message.starts_with(place) && message.contains(words), "{key}: {message}");
        }
    }

    #[test]
    fn every_value_of_the_table_is_read_by_its_key() {
        for (knob, (name, integrator)) in
            KNOBS.iter().flat_map(|knob| Integrator::WORDS.map(|named| (knob, named)))
        {
            let values = knob.values_with(integrator).chain(knob.apart);
            for word in values.filter_map(|value| value.word) {
                let written = match knob.form {
                    KnobForm::Switch => (word == "on").to_string(),
                    KnobForm::Word | KnobForm::Fraction => format!("\"{word}\""),
                    KnobForm::Count(_) | KnobForm::Number(_) => word.to_owned(),
                };
                // With several samples, so that adaptive sampling is accepted.
                let samples = if knob.key == "samples" { "" } else { "samples = 9\n" };
                let head = format!("integrator = \"{name}\"\n{samples}");
                let settings = render(&format!("{head}{} = {written}", knob.key)).unwrap();
                assert_eq!(settings.integrator.usual(), integrator);
                assert!(knob.value(word).unwrap().is_of(&settings.setting()), "{} = {written}", knob.key);
            }
        }
    }

    #[test]
    fn every_whole_number_of_a_range_is_read() {
        for knob in KNOBS {
            let KnobForm::Number(range) = knob.form else { continue };
            if !range.whole {
                continue;
            }
            for number in range.whole_numbers() {
                let settings = render(&format!("{} = {number}", knob.key)).unwrap();
                assert_eq!(range.of(&settings.setting()), number as f32, "{}", knob.key);
            }
        }
        let smallest = render("min_contribution = 1e-300").unwrap();
        assert_eq!(smallest.quality.min_contribution, 0.0);
    }
}
