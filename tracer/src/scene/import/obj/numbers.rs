//! Numbers as programs write them, including infinities and NaN.

use glam::DVec3;

/// Parses a number, including the spellings of C libraries for infinity and NaN: `inf`, `nan(ind)`, `-1.#IND`,
/// `1.#QNAN00`.
pub(super) fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| not_finite(word))
}

/// The first three words as numbers.
pub(super) fn three_numbers(text: &str) -> Option<DVec3> {
    let mut numbers = text.split_ascii_whitespace().map(number);
    Some(DVec3::new(numbers.next()??, numbers.next()??, numbers.next()??))
}

fn not_finite(word: &str) -> Option<f64> {
    let unsigned = word.strip_prefix(['-', '+']).unwrap_or(word);
    if let Some(kind) = unsigned.strip_prefix("1.#") {
        let value = if begins_with(kind, "INF") { f64::INFINITY } else { f64::NAN };
        return begins_like_microsofts(kind).then_some(value);
    }
    begins_with(unsigned, "nan(").then_some(f64::NAN)
}

/// Whether a `#` at this offset belongs to a number in Microsoft's spelling, and begins no comment.
pub(super) fn is_in_a_number(line: &str, hash: usize) -> bool {
    let (before, after) = line.split_at(hash);
    before.ends_with("1.") && begins_like_microsofts(after.get(1..).unwrap_or_default())
}

/// Whether a text continues `1.#` in Microsoft's spelling: `1.#IND`, `1.#QNAN`, `1.#SNAN`, `1.#INF`, optionally with
/// digits.
fn begins_like_microsofts(text: &str) -> bool {
    ["IND", "QNAN", "SNAN", "INF"].iter().any(|kind| begins_with(text, kind))
}

fn begins_with(text: &str, start: &str) -> bool {
    text.get(..start.len()).is_some_and(|text| text.eq_ignore_ascii_case(start))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_every_spelling() {
        for (word, expected) in [("1", 1.0), ("-.5", -0.5), ("1e3", 1000.0), ("+2.", 2.0)] {
            assert_eq!(number(word), Some(expected), "{word}");
        }
        for word in [
            "nan",
            "-nan",
            "NaN",
            "nan(ind)",
            "-nan(ind)",
            "nan(snan)",
            "-1.#IND",
            "1.#QNAN",
            "-1.#IND00",
            "1.#SNAN",
        ] {
            assert!(number(word).is_some_and(f64::is_nan), "{word}");
        }
        for word in ["inf", "1.#INF", "1.#INF00"] {
            assert_eq!(number(word), Some(f64::INFINITY), "{word}");
        }
        for word in ["", "x", "1,5", "1.#", "1.#x", "nanx", "ä(", "0x10", "1D"] {
            assert_eq!(number(word), None, "{word}");
        }
    }

    #[test]
    fn three_numbers_are_required() {
        assert_eq!(three_numbers("1 2\t3 4"), Some(DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!((three_numbers("1 2"), three_numbers("1 2 x")), (None, None));
    }
}
