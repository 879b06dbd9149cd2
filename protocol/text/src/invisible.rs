//! Invisible characters, from the tables of Unicode 16.

use std::ops::RangeInclusive;

/// Ranges in ascending order.
const INVISIBLE: [RangeInclusive<u32>; 25] = [
    0xad..=0xad,       // soft hyphen
    0x34f..=0x34f,     // combining grapheme joiner
    0x61c..=0x61c,     // Arabic letter mark
    0x115f..=0x1160,   // fillers of Hangul
    0x17b4..=0x17b5,   // inherent vowels of Khmer
    0x180b..=0x180f,   // Mongolian variation selectors and vowel separator
    0x200b..=0x200f,   // zero width space, joiners, directional marks
    0x2028..=0x202e,   // separators of lines and paragraphs, bidirectional embeddings and overrides
    0x2060..=0x206f,   // word joiner, invisible operators, bidirectional isolates, deprecated format controls
    0x2800..=0x2800,   // empty Braille pattern
    0x3164..=0x3164,   // filler of Hangul
    0xe000..=0xf8ff,   // private use
    0xfdd0..=0xfdef,   // noncharacters
    0xfe00..=0xfe0f,   // variation selectors
    0xfeff..=0xfeff,   // byte order mark
    0xffa0..=0xffa0,   // half-width filler of Hangul
    0xfff0..=0xfffb,   // reserved specials, interlinear annotations
    0xfffe..=0xffff,   // noncharacters
    0x13430..=0x13455, // Egyptian format controls
    0x1bca0..=0x1bca3, // shorthand format controls
    0x1d173..=0x1d17a, // musical format controls
    0x1fffe..=0x1ffff, // noncharacters
    0x2fffe..=0x2ffff, // the same of the next planes
    0x3fffe..=0x3ffff,
    0x4fffe..=0x10ffff, // planes without characters, tags, more variation selectors, private use
];

/// Whether a character is invisible, or only affects others. Ordinary blanks are not included.
pub(crate) fn is_invisible(c: char) -> bool {
    let code = u32::from(c);
    let at = INVISIBLE.partition_point(|range| *range.end() < code);
    INVISIBLE.get(at).is_some_and(|range| range.contains(&code))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_order() {
        assert!(INVISIBLE.iter().all(|range| range.start() <= range.end()));
        assert!(INVISIBLE.is_sorted_by(|a, b| a.end() < b.start()));
    }
}
