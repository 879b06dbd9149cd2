//! Options of texture statements: tiling, and warnings about the others.

use glam::Vec2;

use super::super::warnings::Warnings;
use super::lines::Line;
use crate::texture::{MAX_TILING, Tiling, Wrap};

/// An option and its words.
pub(super) type TextureOption<'t> = (&'static str, Vec<&'t str>);

/// Unsupported options, with the words that change nothing.
const NOT_DRAWN: &[(&str, &[&str])] = &[
    ("-blendu", &["on"]),
    ("-blendv", &["on"]),
    ("-bm", &["1"]),
    ("-boost", &["0"]),
    ("-cc", &["off"]),
    ("-colorspace", &["sRGB"]),
    ("-imfchan", &[]),
    ("-mm", &["0", "1"]),
    ("-t", &["0", "0", "0"]),
    ("-texres", &[]),
    ("-type", &[]),
];

/// The tiling of the options. The last one of each kind counts; invalid numbers are defaults.
pub(super) fn tiling(options: &[TextureOption<'_>]) -> Tiling {
    let mut tiling = Tiling::default();
    for (option, words) in options {
        match *option {
            "-s" => tiling.scale = pair(words, Vec2::ONE),
            "-o" => tiling.offset = pair(words, Vec2::ZERO),
            "-clamp" => tiling.wrap = if is_on(words) { Wrap::Clamp } else { Wrap::Repeat },
            _ => {}
        }
    }
    tiling
}

/// Warns about unsupported options that would change the picture, once for each.
pub(super) fn warn_of_others(options: &[TextureOption<'_>], line: &Line<'_>, warnings: &mut Warnings) {
    for (option, words) in options {
        let usual = NOT_DRAWN.iter().find(|(known, _)| known == option);
        if usual.is_some_and(|(_, usual)| !says_the_same(words, usual)) {
            let message = format!("the option `{option}` of textures is left out");
            warnings.once(&message, line.number, &message);
        }
    }
}

/// The first two numbers; missing ones are defaults.
fn pair(words: &[&str], default: Vec2) -> Vec2 {
    let number = |index: usize, default: f32| {
        let number = words.get(index).and_then(|word| word.parse::<f32>().ok());
        number.filter(|number| number.abs() <= MAX_TILING).unwrap_or(default)
    };
    Vec2::new(number(0, default.x), number(1, default.y))
}

fn is_on(words: &[&str]) -> bool {
    words.first().is_some_and(|word| word.eq_ignore_ascii_case("on"))
}

fn says_the_same(words: &[&str], usual: &[&str]) -> bool {
    let same = |(word, usual): (&&str, &&str)| match (word.parse::<f64>(), usual.parse::<f64>()) {
        (Ok(number), Ok(usual)) => number == usual,
        _ => word.eq_ignore_ascii_case(usual),
    };
    words.len() <= usual.len() && words.iter().zip(usual).all(same)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_set_the_tiling() {
        let laid = |options: &[TextureOption<'_>]| tiling(options);
        assert_eq!(laid(&[]), Tiling::default());
        let moved = laid(&[("-s", vec!["3", "2", "1"]), ("-o", vec!["0.5"]), ("-mm", vec!["0", "1"])]);
        let expected =
            Tiling { scale: Vec2::new(3.0, 2.0), offset: Vec2::new(0.5, 0.0), ..Tiling::default() };
        assert_eq!(moved, expected);
        assert_eq!(laid(&[("-s", vec!["4"])]).scale, Vec2::new(4.0, 1.0));
        assert_eq!(laid(&[("-clamp", vec!["On"])]).wrap, Wrap::Clamp);
        assert_eq!(laid(&[("-clamp", vec!["off"])]).wrap, Wrap::Repeat);
        assert_eq!(laid(&[("-s", vec!["nan", "1e9"]), ("-o", vec!["inf"])]), Tiling::default());
    }

    #[test]
    fn words_without_effect_are_recognised() {
        assert!(says_the_same(&["0", "1.0"], &["0", "1"]) && says_the_same(&["ON"], &["on"]));
        assert!(says_the_same(&[], &["1"]) && says_the_same(&["0"], &["0", "0", "0"]));
        assert!(!says_the_same(&["0.5"], &["1"]) && !says_the_same(&["m"], &[]));
    }
}
