//! The glyph and the two colours of a cell, by exact least squares.
//!
//! A split of the N pixels of a block gives F pixels the foreground and the other B = N - F the background. Their best colours
//! are the means, and the remaining squared error is the sum of the squared pixels minus |f|^2 / F + |b|^2 / B, where f and b are the
//! sums of the pixels of each part. So the best split has the largest |f|^2 / F + |b|^2 / B.

use super::glyphs::glyph;
use super::{Cell, CellKind, Rgb};

/// A number that 1 to 8 divide, so that the comparison is one of whole numbers.
const DIVISIBLE: i64 = 840;

/// The best cell for the pixels of a block, row by row. The first pixel is always of the background: a split and its reverse show
/// the same. Of equally good splits the one with the lowest number wins, so that equal blocks have equal cells.
pub(super) fn best_cell(kind: CellKind, pixels: &[Rgb]) -> Cell {
    let count = pixels.len();
    let total = pixels.iter().fold([0; 3], |sum, pixel| add(sum, *pixel, 1));
    let mut best = (share(total, count), 0, [0; 3]);
    let mut front = [0; 3];
    // In the order of a Gray code, so that each split differs from the last one in one pixel.
    for step in 1..1_u32 << (count.max(1) - 1) {
        let gray = step ^ (step >> 1);
        let changed = step.trailing_zeros() as usize + 1;
        let split = gray << 1;
        let sign = if split >> changed & 1 == 1 { 1 } else { -1 };
        front = add(front, pixels.get(changed).copied().unwrap_or_default(), sign);
        let size = split.count_ones() as usize;
        let back = [total[0] - front[0], total[1] - front[1], total[2] - front[2]];
        let score = share(front, size) + share(back, count - size);
        if score > best.0 || (score == best.0 && best.1 != 0 && split < best.1) {
            best = (score, split, front);
        }
    }
    let (_, split, front) = best;
    let size = split.count_ones() as usize;
    let back = [total[0] - front[0], total[1] - front[1], total[2] - front[2]];
    let background = mean(back, count - size);
    let foreground = if size == 0 { background } else { mean(front, size) };
    if foreground == background {
        return Cell::filled(background);
    }
    Cell { glyph: glyph(kind, split as u8), foreground, background }
}

/// The squared length of a sum of `count` pixels over their number, times [`DIVISIBLE`].
fn share(sum: [i32; 3], count: usize) -> i64 {
    let squared: i64 = sum.iter().map(|&part| i64::from(part) * i64::from(part)).sum();
    // The sum of no pixels is 0.
    squared * (DIVISIBLE / count.max(1) as i64)
}

fn add(sum: [i32; 3], pixel: Rgb, sign: i32) -> [i32; 3] {
    let [red, green, blue] = pixel.map(i32::from);
    [sum[0] + sign * red, sum[1] + sign * green, sum[2] + sign * blue]
}

/// The rounded mean of `count` pixels.
fn mean(sum: [i32; 3], count: usize) -> Rgb {
    let count = count.max(1) as i32;
    sum.map(|part| ((part + count / 2) / count).clamp(0, 255) as u8)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::glyphs::mask_of;
    use super::*;

    const KINDS: [CellKind; 4] = [CellKind::Half, CellKind::Quadrant, CellKind::Sextant, CellKind::Octant];

    /// Squared error of a cell against its pixels.
    fn error(kind: CellKind, cell: &Cell, pixels: &[Rgb]) -> i64 {
        let mask = mask_of(kind, cell.glyph).unwrap();
        let squared = |(index, pixel): (usize, &Rgb)| {
            let shown = if mask >> index & 1 == 1 { cell.foreground } else { cell.background };
            (0..3).map(|c| (i64::from(pixel[c]) - i64::from(shown[c])).pow(2)).sum::<i64>()
        };
        pixels.iter().enumerate().map(squared).sum()
    }

    /// Least squared error over all splits with mean colours, rounded.
    fn least_error(pixels: &[Rgb]) -> i64 {
        let all = 0..1_u32 << pixels.len();
        let of = |split: u32| {
            let part = |front: bool| {
                let chosen: Vec<Rgb> = (0..pixels.len())
                    .filter(|index| (split >> index & 1 == 1) == front)
                    .map(|index| pixels[index])
                    .collect();
                let sum = chosen.iter().fold([0; 3], |sum, pixel| add(sum, *pixel, 1));
                let shown = mean(sum, chosen.len());
                let squared = |pixel: &Rgb| {
                    (0..3).map(|c| (i64::from(pixel[c]) - i64::from(shown[c])).pow(2)).sum::<i64>()
                };
                chosen.iter().map(squared).sum::<i64>()
            };
            part(true) + part(false)
        };
        all.map(of).min().unwrap()
    }

    #[test]
    fn two_colours_are_shown_exactly() {
        let (red, blue) = ([200, 10, 20], [3, 4, 250]);
        for kind in KINDS {
            let (columns, rows) = kind.pixels();
            let count = columns * rows;
            for split in 0..1_u32 << count {
                let pixels: Vec<Rgb> =
                    (0..count).map(|index| if split >> index & 1 == 1 { red } else { blue }).collect();
                let cell = best_cell(kind, &pixels);
                assert_eq!(error(kind, &cell, &pixels), 0, "{kind:?} {split:b}");
            }
        }
    }

    proptest! {
        #[test]
        fn no_split_has_a_smaller_error(pixels in prop::collection::vec(any::<[u8; 3]>(), 8)) {
            for kind in KINDS {
                let (columns, rows) = kind.pixels();
                let pixels = &pixels[..columns * rows];
                let cell = best_cell(kind, pixels);
                // Rounding of the means adds at most 1/4 per pixel and channel to the exact least error.
                let slack = (pixels.len() * 3) as i64;
                prop_assert!(error(kind, &cell, pixels) <= least_error(pixels) + slack);
            }
        }
    }
}
