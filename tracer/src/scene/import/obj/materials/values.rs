//! Numbers and colours of statements, and warnings about odd ones.

use super::super::super::printed::excerpt;
use super::super::super::warnings::Warnings;
use super::super::lines::Line;

/// Smallest exponent of a highlight that is drawn. With a smaller one it would cover nearly all of the lit side; programs
/// write `Ns 0` for no highlight.
pub(super) const SMALLEST_EXPONENT: f64 = 1.0;

/// `Kd r g b`, or `Kd r` for grey.
pub(super) fn color(line: &Line<'_>) -> Result<[f64; 3], String> {
    let words: Vec<&str> = line.rest().split_ascii_whitespace().take(4).collect();
    let numbers: Option<Vec<f64>> =
        words.iter().map(|word| word.parse().ok().filter(|n: &f64| n.is_finite())).collect();
    match (numbers.as_deref(), words.first()) {
        (Some([grey]), _) => Ok([*grey; 3]),
        (Some([r, g, b]), _) => Ok([*r, *g, *b]),
        (_, Some(kind)) if kind.eq_ignore_ascii_case("spectral") || kind.eq_ignore_ascii_case("xyz") => {
            Err(format!("`{}`: `{kind}` colours are not read, only red, green and blue", shortened(line)))
        }
        _ => Err(format!("`{}`: three numbers were expected{}", shortened(line), comma_hint(line))),
    }
}

/// The final word of a line as a number.
pub(super) fn number(line: &Line<'_>) -> Result<f64, String> {
    // `d -halo 0.5` has a word in between.
    let word = line.rest().split_ascii_whitespace().last().unwrap_or_default();
    let number = word.parse().ok().filter(|n: &f64| n.is_finite());
    number.ok_or_else(|| format!("`{}`: a number was expected{}", shortened(line), comma_hint(line)))
}

/// A hint for decimal commas, which some programs write in some countries.
fn comma_hint(line: &Line<'_>) -> &'static str {
    let has_comma = |word: &str| word.contains(',') && word.replace(',', ".").parse::<f64>().is_ok();
    if line.rest().split_ascii_whitespace().any(has_comma) {
        " (decimal points, not commas: export the model again with the settings of an English system)"
    } else {
        ""
    }
}

/// A number within 0 and `limit`, and a warning where it was not.
pub(super) fn bounded(value: f64, limit: f64, line: &Line<'_>, warnings: &mut Warnings) -> f64 {
    if !(0.0..=limit).contains(&value) {
        let message = format!("`{}`: taken to the nearest value from 0 to {limit}", shortened(line));
        warnings.at_line(line.number, message);
    }
    value.clamp(0.0, limit)
}

/// A colour with channels from 0 to 1, and one warning where it had others.
pub(super) fn bounded_color(
    color: [f64; 3],
    keyword: &str,
    line: &Line<'_>,
    warnings: &mut Warnings,
) -> [f64; 3] {
    // More than 1 by rounding is 1.
    const ROUNDING: f64 = 1e-5;
    let largest = color.into_iter().fold(0.0, f64::max);
    if color.iter().any(|channel| !(-ROUNDING..=1.0 + ROUNDING).contains(channel)) {
        let hint = if largest > 2.0 && largest <= 255.0 {
            let [r, g, b] = color.map(|channel| (channel / 255.0 * 1000.0).round() / 1000.0);
            format!("; for colours from 0 to 255 divide by 255, as in `{keyword} {r} {g} {b}`")
        } else {
            String::new()
        };
        let message = format!(
            "`{}`: colours from 0 to 1 were expected, others are taken to the nearest one{hint}",
            shortened(line)
        );
        warnings.at_line(line.number, message);
    }
    color.map(|channel| channel.clamp(0.0, 1.0))
}

/// Characters of a name or line that a message shows.
pub(super) const MAX_SHOWN: usize = 60;

/// The beginning of a line, for messages.
pub(super) fn shortened(line: &Line<'_>) -> String {
    excerpt(&line.text, MAX_SHOWN)
}
