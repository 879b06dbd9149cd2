use std::borrow::Cow;

use proptest::prelude::*;

use super::*;

#[test]
fn ordinary_text_is_unchanged_in_every_script() {
    for text in ["mill-3", "Küche 2", "작업자", "σκηνή", "мельница", "厨房", "a\\b", "ไม้", "Việt", "שָׁלוֹם"]
    {
        assert!(
            matches!(printable(text), Cow::Borrowed(same) if same == text),
            "{text:?}: {}",
            printable(text)
        );
    }
    // A vowel and three accents, each a character of its own.
    let stacked = "e\u{323}\u{302}\u{301}!";
    assert_eq!(printable(stacked), stacked);
}

#[test]
fn characters_that_affect_others_are_escaped() {
    for (text, shown) in [
        ("a\x1b[2Jb\nc", "a\\u{1b}[2Jb\\nc"),
        ("\r\t\0\x7f\u{85}", "\\r\\t\\u{0}\\u{7f}\\u{85}"),
        ("one\u{2028}two\u{2029}", "one\\u{2028}two\\u{2029}"),
        ("\u{202e}gnp.\u{2066}\u{200f}\u{61c}", "\\u{202e}gnp.\\u{2066}\\u{200f}\\u{61c}"),
        ("mi\u{200b}ll\u{feff}\u{2060}\u{ad}", "mi\\u{200b}ll\\u{feff}\\u{2060}\\u{ad}"),
        ("x\u{e0041}\u{e007f}\u{e0100}\u{fe0f}", "x\\u{e0041}\\u{e007f}\\u{e0100}\\u{fe0f}"),
        ("\u{e000}\u{f8ff}\u{f0000}\u{10fffd}", "\\u{e000}\\u{f8ff}\\u{f0000}\\u{10fffd}"),
        ("\u{3164}\u{115f}\u{2800}", "\\u{3164}\\u{115f}\\u{2800}"),
    ] {
        assert_eq!(printable(text), shown);
    }
}

#[test]
fn marks_are_limited_to_four_and_never_first() {
    let piled = format!("a{}b", "\u{301}".repeat(6));
    assert_eq!(printable(&piled), format!("a{}\\u{{301}}\\u{{301}}b", "\u{301}".repeat(4)));
    assert_eq!(printable("\u{301}a"), "\\u{301}a");
    assert_eq!(printable("a\n\u{20dd}"), "a\\n\\u{20dd}");
    assert_eq!(printable("a \u{301}"), "a \\u{301}");
}

#[test]
fn invisible_text_has_a_substitute() {
    assert_eq!(printable(""), "(empty)");
    assert_eq!(printable(" \u{a0}\u{3000}"), "(blank)");
    assert_eq!(printable("\n"), "\\n");
    assert_eq!(printable_within("", 100), "(empty)");
}

#[test]
fn long_text_is_cut_between_characters_and_escapes() {
    assert_eq!(printable_within("abcdef", 6), "abcdef");
    assert_eq!(printable_within("abcdefg", 6), "abc…");
    assert_eq!(printable_within("ab\n\n\n", 7), "ab\\n…");
    assert_eq!(printable_within("ab\u{202e}", 9), "ab…");
    assert_eq!(printable_within("abc", 2), "");
    assert_eq!(printable_within(&"x".repeat(10_000_000), 5), "xx…");
    assert_eq!(cut("aäöü", 4), "aä");
    assert_eq!(cut("aäöü", 3), "aä");
    assert_eq!(cut("ä", 1), "");
}

/// Whether a terminal shows every character of a text, and nothing but them.
fn is_plain(text: &str) -> bool {
    let mut marks = MAX_MARKS;
    text.chars().all(|c| {
        let is_mark = c.width() == Some(0);
        marks = if is_mark { marks + 1 } else { 0 };
        !c.is_control() && !is_invisible(c) && marks <= MAX_MARKS
    })
}

proptest! {
    #[test]
    fn whatever_comes_is_plain_bounded_and_stays_so(
        text in "(\\PC|\\p{M}|\\p{C}|[\u{200b}-\u{202e}\u{e0000}-\u{e007f}\u{301}\\x00-\\x20]){0,60}",
        room in 0_usize..200,
    ) {
        let shown = printable(&text);
        prop_assert!(is_plain(&shown), "{shown:?}");
        prop_assert!(!shown.trim().is_empty());
        prop_assert_eq!(printable(&shown), shown.as_ref());
        let short = printable_within(&text, room);
        prop_assert!(short.len() <= room.max(EMPTY.len()) && is_plain(&short), "{short:?}");
        prop_assert!(short.len() < shown.len() || short == shown);
    }

    #[test]
    fn each_character_alone_is_plain(c: char) {
        prop_assert!(is_plain(&printable(&c.to_string())));
    }
}
