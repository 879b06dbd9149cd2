//! Faults of a scene file with their places, and suggestions of known words.

use toml::Spanned;
use toml::de::DeValue;

use crate::scene::import::excerpt;

/// A fault at a position of the text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fault {
    /// Offset into the text, in bytes.
    pub(crate) at: usize,
    /// The fault, what was expected, and what to do.
    pub(crate) message: String,
}

/// Result of reading a part of the text.
pub(super) type Read<T> = Result<T, Fault>;

impl Fault {
    pub(super) fn at(at: usize, message: impl Into<String>) -> Self {
        Self { at, message: message.into() }
    }

    pub(super) fn at_value(value: &Spanned<DeValue<'_>>, message: impl Into<String>) -> Self {
        Self::at(value.span().start, message)
    }
}

/// Keeps the first fault in the text, in whatever order the sections are read.
#[derive(Default)]
pub(super) struct FirstFault(Option<Fault>);

impl FirstFault {
    /// The value; or `None`, with the fault recorded.
    pub(super) fn keep<T>(&mut self, read: Read<T>) -> Option<T> {
        match read {
            Ok(value) => Some(value),
            Err(fault) => {
                if self.0.as_ref().is_none_or(|first| fault.at < first.at) {
                    self.0 = Some(fault);
                }
                None
            }
        }
    }

    /// Whether no fault is recorded.
    pub(super) fn is_none(&self) -> bool {
        self.0.is_none()
    }

    pub(super) fn into_result(self) -> Read<()> {
        self.0.map_or(Ok(()), Err)
    }
}

/// Line and column of an offset, both counted from 1; columns are characters.
pub(crate) fn place(text: &str, at: usize) -> (usize, usize) {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    let before = text.get(..at).unwrap_or_default();
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    (line, column)
}

/// "; did you mean `color`?" if a known word is similar enough, otherwise the result of `otherwise` for the list of
/// known words.
pub(super) fn suggestion<'k>(
    word: &str,
    known: impl IntoIterator<Item = &'k str> + Clone,
    otherwise: impl FnOnce(String) -> String,
) -> String {
    match nearest(word, known.clone()) {
        Some(known) => format!("; did you mean `{known}`?"),
        None => {
            let list: Vec<String> = known.into_iter().take(MAX_LISTED).map(|k| format!("`{k}`")).collect();
            otherwise(list.join(", "))
        }
    }
}

/// Largest number of known words in a message.
const MAX_LISTED: usize = 20;

/// The known word with the smallest edit distance, if that is at most a third of its length (or one).
fn nearest<'k>(word: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
    // A word of a thousand letters is no typing error, and the distance takes quadratic time.
    if word.len() > 100 {
        return None;
    }
    let lower = word.to_lowercase();
    known
        .into_iter()
        .map(|k| (strsim::osa_distance(&lower, &k.to_lowercase()), k))
        .filter(|(slips, k)| *slips <= (k.chars().count() / 3).max(1))
        .min_by_key(|(slips, _)| *slips)
        .map(|(_, k)| k)
}

/// The beginning of a text from the file, escaped, for messages.
pub(super) fn shortened(text: &str) -> String {
    const MAX_CHARS: usize = 60;
    excerpt(text, MAX_CHARS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_characters_from_one() {
        let text = "ab\näöü = 1\nx";
        assert_eq!(place(text, 0), (1, 1));
        assert_eq!(place(text, 2), (1, 3));
        assert_eq!(place(text, text.find('=').unwrap()), (2, 5));
        assert_eq!(place(text, text.len()), (3, 2));
        assert_eq!(place(text, 1_000), (3, 2));
        // Inside of a character.
        assert_eq!(place(text, 4), (2, 1));
    }

    #[test]
    fn similar_words_are_suggested_and_others_are_not() {
        let known = ["color", "position", "fov"];
        assert_eq!(nearest("colour", known), Some("color"));
        assert_eq!(nearest("Color", known), Some("color"));
        assert_eq!(nearest("postion", known), Some("position"));
        assert_eq!(nearest("fv", known), Some("fov"));
        assert_eq!(nearest("zzz", known), None);
        assert_eq!(nearest(&"c".repeat(100_000), known), None);
    }

    #[test]
    fn text_of_the_file_is_printable_and_short() {
        assert_eq!(shortened("a\u{1b}[31mb\u{202e}\n"), r"a\u{1b}[31mb\u{202e}\n");
        assert_eq!(shortened(&"ä".repeat(100)), format!("{}...", "ä".repeat(60)));
    }

    #[test]
    fn the_first_fault_in_the_text_is_kept() {
        let mut first = FirstFault::default();
        assert_eq!(first.keep::<u8>(Err(Fault::at(9, "late"))), None);
        assert_eq!(first.keep::<u8>(Err(Fault::at(3, "early"))), None);
        assert_eq!(first.keep(Ok(1)), Some(1));
        assert_eq!(first.into_result(), Err(Fault::at(3, "early")));
    }
}
