//! The characters of all splits of a cell. Bit i of a split is pixel i, row by row from the upper left.
//!
//! Names and numbers are those of the Unicode blocks "Block Elements", "Symbols for Legacy Computing" (sextants) and its
//! supplement (octants). Splits that older characters show have no character of their own in the newer blocks.

use std::sync::LazyLock;

use super::CellKind;

/// The sixteen splits of a cell into quadrants: upper left, upper right, lower left, lower right.
const QUADRANTS: [char; 16] =
    [' ', '▘', '▝', '▀', '▖', '▌', '▞', '▛', '▗', '▚', '▐', '▜', '▄', '▙', '▟', '█'];

/// Splits into octants that do not belong to the run of octant characters and are no quadrants, with their characters.
const OTHER_OCTANTS: [(u8, u32); 10] = [
    (0x01, 0x1CEA8), // left half upper one quarter block
    (0x02, 0x1CEAB), // right half upper one quarter block
    (0x03, 0x1FB82), // upper one quarter block
    (0x14, 0x1FBE6), // middle left one quarter block
    (0x28, 0x1FBE7), // middle right one quarter block
    (0x3F, 0x1FB85), // upper three quarters block
    (0x40, 0x1CEA3), // left half lower one quarter block
    (0x80, 0x1CEA0), // right half lower one quarter block
    (0xC0, 0x2582),  // lower one quarter block
    (0xFC, 0x2586),  // lower three quarters block
];

/// The characters of all splits into octants.
static OCTANTS: LazyLock<[char; 256]> = LazyLock::new(|| std::array::from_fn(|split| octant(split as u8)));

/// The first octant character.
const FIRST_OCTANT: u32 = 0x1CD00;

/// The first sextant character.
const FIRST_SEXTANT: u32 = 0x1FB00;

/// The character of a split.
pub(super) fn glyph(kind: CellKind, split: u8) -> char {
    match kind {
        CellKind::Half => [' ', '▀', '▄', '█'][usize::from(split & 3)],
        CellKind::Quadrant => QUADRANTS[usize::from(split & 15)],
        CellKind::Sextant => sextant(split & 63),
        CellKind::Octant => OCTANTS[usize::from(split)],
    }
}

fn sextant(split: u8) -> char {
    match split {
        0 => ' ',
        0b01_0101 => '▌',
        0b10_1010 => '▐',
        63 => '█',
        split => {
            let skipped = 1 + u32::from(split > 0b01_0101) + u32::from(split > 0b10_1010);
            character(FIRST_SEXTANT + u32::from(split) - skipped)
        }
    }
}

fn octant(split: u8) -> char {
    if let Some(quadrants) = as_quadrants(split) {
        return QUADRANTS[usize::from(quadrants)];
    }
    if let Some((_, number)) = OTHER_OCTANTS.iter().find(|(other, _)| *other == split) {
        return character(*number);
    }
    let has_own =
        |other: &u8| as_quadrants(*other).is_none() && OTHER_OCTANTS.iter().all(|(it, _)| it != other);
    character(FIRST_OCTANT + (0..split).filter(has_own).count() as u32)
}

/// A split into octants as one into quadrants, if it is one.
fn as_quadrants(split: u8) -> Option<u8> {
    const PARTS: [u8; 4] = [0x05, 0x0A, 0x50, 0xA0];
    let mut quadrants = 0;
    for (index, part) in PARTS.into_iter().enumerate() {
        match split & part {
            0 => {}
            all if all == part => quadrants |= 1 << index,
            _ => return None,
        }
    }
    Some(quadrants)
}

/// A character by number. All numbers of this file are characters, which a test checks.
fn character(number: u32) -> char {
    char::from_u32(number).unwrap_or(char::REPLACEMENT_CHARACTER)
}

/// The split that a character shows.
#[cfg(test)]
pub(in crate::display::terminal) fn mask_of(kind: CellKind, of: char) -> Option<u8> {
    let (columns, rows) = kind.pixels();
    let splits = 1_u32 << (columns * rows);
    (0..splits).map(|split| split as u8).find(|split| glyph(kind, *split) == of)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn each_split_has_a_character_of_its_own() {
        for (kind, splits) in [
            (CellKind::Half, 4),
            (CellKind::Quadrant, 16),
            (CellKind::Sextant, 64),
            (CellKind::Octant, 256_u32),
        ] {
            let glyphs: BTreeSet<char> = (0..splits).map(|split| glyph(kind, split as u8)).collect();
            assert_eq!(glyphs.len() as u32, splits, "{kind:?}");
            assert!(!glyphs.contains(&char::REPLACEMENT_CHARACTER));
        }
    }

    #[test]
    fn characters_are_those_of_unicode() {
        // BLOCK SEXTANT-1, BLOCK SEXTANT-23, BLOCK SEXTANT-135 is the left half, BLOCK SEXTANT-23456.
        let sextants = [(0b1, 0x1FB00), (0b110, 0x1FB05), (0b01_0101, 0x258C), (0b11_1110, 0x1FB3B)];
        for (split, number) in sextants {
            assert_eq!(glyph(CellKind::Sextant, split) as u32, number, "{split:b}");
        }
        // BLOCK OCTANT-3, -23, -123, -4, -14 and -2345678.
        let octants = [
            (0b100, 0x1CD00),
            (0b110, 0x1CD01),
            (0b111, 0x1CD02),
            (0b1000, 0x1CD03),
            (0b1001, 0x1CD04),
            (0b1111_1110, 0x1CDE5),
        ];
        for (split, number) in octants {
            assert_eq!(glyph(CellKind::Octant, split) as u32, number, "{split:b}");
        }
        assert_eq!(glyph(CellKind::Octant, 0x0F), '▀');
        assert_eq!(glyph(CellKind::Octant, 0xFF), '█');
        assert_eq!(glyph(CellKind::Quadrant, 0b1001), '▚');
    }
}
