//! Sixel, the pictures of DEC's terminals: bands of six rows, drawn once for each of their colours.
//!
//! The palette is fixed: a cube of 6 x 6 x 6 colours, with ordered dithering (Bayer 1973), so that a still picture has the same bytes
//! each time. A library that computes a palette for each picture was not used: it brings forty crates, and one that this project bans.

use std::io::Write;

/// Levels of each channel in the palette.
const LEVELS: usize = 6;
/// Rows of a band.
const BAND: usize = 6;
/// Thresholds of a 4 x 4 pattern, in sixteenths.
const PATTERN: [[i32; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];

/// Appends a picture of `width` pixels per row and three bytes per pixel.
pub(super) fn encode(width: usize, rgb: &[u8], out: &mut Vec<u8>) {
    let height = rgb.len() / (width * 3).max(1);
    // Writing to memory does not fail.
    let _ = write!(out, "\x1bPq\"1;1;{width};{height}");
    for color in 0..LEVELS * LEVELS * LEVELS {
        let percent = |level: usize| level * 100 / (LEVELS - 1);
        let [red, green, blue] =
            [color / (LEVELS * LEVELS), color / LEVELS % LEVELS, color % LEVELS].map(percent);
        let _ = write!(out, "#{color};2;{red};{green};{blue}");
    }
    for (band, rows) in rgb.chunks((width * 3 * BAND).max(1)).enumerate() {
        encode_band(band * BAND, width, rows, out);
    }
    out.extend_from_slice(b"\x1b\\");
}

/// Appends up to six rows: for each colour that they have, one character per column whose bits are its rows.
fn encode_band(first_row: usize, width: usize, rows: &[u8], out: &mut Vec<u8>) {
    let mut columns_of = vec![Vec::new(); LEVELS * LEVELS * LEVELS];
    for (row, pixels) in rows.chunks_exact(width * 3).enumerate() {
        for (column, pixel) in pixels.chunks_exact(3).enumerate() {
            let color = palette_index(pixel, first_row + row, column);
            let Some(columns) = columns_of.get_mut(color) else { continue };
            if columns.is_empty() {
                columns.resize(width, 0_u8);
            }
            if let Some(bits) = columns.get_mut(column) {
                *bits |= 1 << row;
            }
        }
    }
    for (color, columns) in columns_of.iter().enumerate().filter(|(_, columns)| !columns.is_empty()) {
        let _ = write!(out, "#{color}");
        for run in columns.chunk_by(|a, b| a == b) {
            let character = char::from(63 + run.first().copied().unwrap_or(0));
            // A repeat count takes three characters or more.
            let _ = match run.len() {
                length @ 0..=3 => out.write_all(&[character as u8; 3][..length]),
                length => write!(out, "!{length}{character}"),
            };
        }
        out.push(b'$');
    }
    out.push(b'-');
}

/// The number of a pixel's colour in the palette.
fn palette_index(pixel: &[u8], row: usize, column: usize) -> usize {
    let threshold = PATTERN[row % 4][column % 4];
    pixel.iter().fold(0, |index, &part| {
        let steps = LEVELS as i32 - 1;
        // In sixteenths of a level, then rounded down after the threshold: 15 / 16 at most, so that white stays white.
        let level = (i32::from(part) * steps * 16 / 255 + threshold) / 16;
        index * LEVELS + level.clamp(0, steps) as usize
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The picture that a sixel string draws, in palette indices.
    fn decoded(text: &str, width: usize, height: usize) -> Vec<Option<usize>> {
        let body = text.strip_prefix("\x1bPq\"1;1;").unwrap().strip_suffix("\x1b\\").unwrap();
        let body = &body[body.find('#').unwrap()..];
        let mut picture = vec![None; width * height];
        let (mut color, mut column, mut band, mut at) = (0, 0, 0, 0);
        let bytes = body.as_bytes();
        let number = |at: &mut usize| {
            let start = *at;
            while bytes.get(*at).is_some_and(u8::is_ascii_digit) {
                *at += 1;
            }
            body[start..*at].parse::<usize>().unwrap()
        };
        while at < bytes.len() {
            let byte = bytes[at];
            at += 1;
            let (count, sixel) = match byte {
                b'#' => {
                    color = number(&mut at);
                    while bytes.get(at) == Some(&b';') {
                        at += 1;
                        number(&mut at);
                    }
                    continue;
                }
                b'$' => {
                    column = 0;
                    continue;
                }
                b'-' => {
                    (band, column) = (band + 1, 0);
                    continue;
                }
                b'!' => {
                    let count = number(&mut at);
                    at += 1;
                    (count, bytes[at - 1] - 63)
                }
                byte => (1, byte - 63),
            };
            for _ in 0..count {
                for row in (0..BAND).filter(|row| sixel >> row & 1 == 1) {
                    let pixel = &mut picture[(band * BAND + row) * width + column];
                    assert_eq!(*pixel, None, "a pixel is drawn twice");
                    *pixel = Some(color);
                }
                column += 1;
            }
        }
        picture
    }

    #[test]
    fn a_decoder_finds_the_dithered_colours_of_all_pixels() {
        let (width, height) = (37, 14);
        let rgb: Vec<u8> = (0..width * height * 3).map(|i| (i * i * 31 / 7 % 256) as u8).collect();
        let mut out = Vec::new();
        encode(width, &rgb, &mut out);
        let picture = decoded(&String::from_utf8(out).unwrap(), width, height);
        for (index, (shown, pixel)) in picture.iter().zip(rgb.chunks_exact(3)).enumerate() {
            assert_eq!(*shown, Some(palette_index(pixel, index / width, index % width)));
        }
    }

    #[test]
    fn dithering_keeps_the_mean_and_the_ends() {
        let mean = |value: u8| {
            let levels = (0..16).map(|i| palette_index(&[value; 3], i / 4, i % 4) % LEVELS).sum::<usize>();
            levels as f64 / 16.0 / (LEVELS - 1) as f64 * 255.0
        };
        assert_eq!((mean(0), mean(255)), (0.0, 255.0));
        for value in 0..=255 {
            assert!((mean(value) - f64::from(value)).abs() < 255.0 / 80.0 + 1.0, "{value}: {}", mean(value));
        }
    }
}
