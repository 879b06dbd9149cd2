//! Escaping of text from files in messages: control sequences and invisible characters.

use rayfarm_text::printable;

/// The text as escaped by [`rayfarm_text::printable`]; an empty one remains empty.
pub(in crate::scene) fn escaped(text: &str) -> String {
    if text.is_empty() { String::new() } else { printable(text).into_owned() }
}

/// The escaped beginning of a text, at most `most` characters of it.
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
    fn control_sequences_are_escaped() {
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
