//! The knobs of `[render]` that trade accuracy for speed.

use super::super::{ColorDepth, ExponentPrecision, Filter, Quality, RenderScale, Shading};
use super::fault::Read;
use super::table::Table;
use super::value::Value;

/// The knobs that the tracer knows.
pub(super) fn quality(table: Table<'_>) -> Read<Quality> {
    let full = Quality::default();
    Ok(Quality {
        shadows: table.read("shadows", |value| value.boolean())?.unwrap_or(full.shadows),
        adaptive: table.read("adaptive", |value| value.boolean())?.unwrap_or(full.adaptive),
        shading: table.read("shading", |value| value.word(&Shading::WORDS))?.unwrap_or(full.shading),
        filter: table.read("filter", |value| value.word(&Filter::WORDS))?,
        exponent: table
            .read("exponent", |value| value.word(&ExponentPrecision::WORDS))?
            .unwrap_or(full.exponent),
        colors: table.read("pixels", |value| value.word(&ColorDepth::WORDS))?.unwrap_or(full.colors),
        dither: table.read("dither", |value| value.boolean())?.unwrap_or(full.dither),
    })
}

/// The part of width and height that is rendered.
pub(super) fn scale(value: Value<'_>) -> Read<RenderScale> {
    if value.value.get_ref().is_str() {
        return value.word(&RenderScale::WORDS);
    }
    let expected = "that is 1, 0.75, 0.5 or 0.25, or one of \"3/4\", \"1/2\", \"1/3\", \"1/4\"";
    let known = |number: f64| RenderScale::ALL.into_iter().find(|scale| is_written(*scale, number));
    let number = value.number(expected, |number| known(number).is_some())?;
    known(number).ok_or_else(|| value.must_be(&format!("a number {expected}")))
}

/// Whether a number stands for a scale: a third has no end, so two digits of it will do.
fn is_written(scale: RenderScale, number: f64) -> bool {
    match scale {
        RenderScale::Third => (number - scale.factor()).abs() < 0.0034,
        _ => number == scale.factor(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::RenderSettings;
    use super::super::{place, read};
    use super::*;

    fn render(keys: &str) -> Result<RenderSettings, String> {
        let text = format!("[render]\n{keys}");
        read(&text).map(|scene| scene.render).map_err(|fault| {
            let (line, column) = place(&text, fault.at);
            format!("{line}:{column} {}", fault.message)
        })
    }

    #[test]
    fn every_knob_is_read() {
        let all = "samples = 4\nadaptive = true\nshadows = false\nshading = \"diffuse\"\nfilter = \"nearest\"\nexponent = \"fast\"\n\
                   pixels = \"reduced\"\nscale = 0.75\ndither = true";
        let reduced = Quality {
            shadows: false,
            adaptive: true,
            shading: Shading::Diffuse,
            filter: Some(Filter::Nearest),
            exponent: ExponentPrecision::Fast,
            colors: ColorDepth::Reduced,
            dither: true,
        };
        let render_all = render(all).unwrap();
        assert_eq!((render_all.quality, render_all.scale), (reduced, RenderScale::ThreeQuarters));
        let full = "adaptive = false\nshadows = true\nshading = \"full\"\nexponent = \"exact\"\npixels = \"exact\"\nscale = 1\ndither = false";
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
    fn other_positions_are_refused_with_their_place() {
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
            ("scael = 1", "2:1 ", "did you mean `scale`?"),
        ] {
            let message = render(key).unwrap_err();
            assert!(message.starts_with(place) && message.contains(words), "{key}: {message}");
        }
    }
}
