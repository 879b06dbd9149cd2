//! Text that came from, or goes to, the other side.

/// Cuts to at most `max_bytes`, between characters.
pub(crate) fn cut(text: &str, max_bytes: usize) -> &str {
    let mut end = text.len().min(max_bytes);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    text.get(..end).unwrap_or_default()
}

/// A peer's text is printed into logs and terminals: control characters in it must not move a cursor or forge a line.
pub(crate) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_between_characters() {
        assert_eq!(cut("aäöü", 4), "aä");
        assert_eq!(cut("aäöü", 3), "aä");
        assert_eq!(cut("abc", 9), "abc");
        assert_eq!(cut("ä", 1), "");
    }

    #[test]
    fn control_characters_are_replaced() {
        assert_eq!(printable("a\x1b[2Jb\nc"), "a\u{fffd}[2Jb\u{fffd}c");
    }
}
