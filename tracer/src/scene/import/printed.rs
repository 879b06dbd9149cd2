//! Words of files in messages: what a terminal would obey, and what has no glyph, is printed as an escape.

use rayfarm_text::printable;

/// The text as [`rayfarm_text::printable`] shows it; an empty one stays empty.
pub(in crate::scene) fn escaped(text: &str) -> String {
    if text.is_empty() { String::new() } else { printable(text).into_owned() }
}

/// The beginning of a text, escaped, of at most `most` characters.
pub(in crate::scene) fn excerpt(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        None => escaped(text),
        Some((end, _)) => escaped(text.get(..end).unwrap_or_default()) + "...",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_escaped() {
        for (text, printed) in [
            ("wood.png", "wood.png"),
            ("grün # 2", "grün # 2"),
            ("models\new.obj", "models\\new.obj"),
            ("a\x1b[2Jb\tc\r", "a\\u{1b}[2Jb\\tc\\r"),
            ("\u{202e}gnp\u{200b}\u{2028}", "\\u{202e}gnp\\u{200b}\\u{2028}"),
        ] {
            assert_eq!(escaped(text), printed);
        }
    }

    #[test]
    fn long_texts_are_cut() {
        assert_eq!(excerpt("abc", 3), "abc");
        assert_eq!(excerpt("äbcd\n", 2), "äb...");
        assert_eq!(excerpt("\n\n\n", 2), "\\n\\n...");
    }
}
