//! Cells as bytes for the terminal: only cells that have changed, with as few changes of colour and position as possible.

use std::io::Write;

use super::cells::{Cell, Rgb};

/// Beginning and end of a synchronised update (private mode 2026): the terminal shows it at once, or ignores both.
const BEGIN_UPDATE: &[u8] = b"\x1b[?2026h";
const END_UPDATE: &[u8] = b"\x1b[?2026l";

/// Colours that a terminal has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Colors {
    /// 24 bits.
    #[default]
    True,
    /// The 256 colours of xterm: a cube of 6 x 6 x 6 and 24 greys.
    Indexed,
}

/// What the terminal shows.
#[derive(Debug)]
pub(super) struct Encoder {
    colors: Colors,
    columns: usize,
    /// Cells on the screen, row by row; `None` where that is not known.
    shown: Vec<Option<Cell>>,
}

/// Colours that the terminal draws with, as far as they are known.
#[derive(Clone, Copy, Debug, Default)]
struct Pen {
    foreground: Option<Rgb>,
    background: Option<Rgb>,
}

impl Encoder {
    /// An encoder for a screen of which nothing is known.
    pub(super) fn new(colors: Colors) -> Self {
        Self { colors, columns: 0, shown: Vec::new() }
    }

    /// Forgets what the screen shows: after a change of its size, or when another program has drawn on it.
    pub(super) fn forget(&mut self) {
        self.shown.clear();
    }

    /// Appends the bytes that make a screen of `columns` show these cells. Nothing is appended where it shows them already.
    pub(super) fn update(&mut self, cells: &[Cell], columns: usize, out: &mut Vec<u8>) {
        if self.columns != columns || self.shown.len() != cells.len() {
            self.columns = columns;
            self.shown = vec![None; cells.len()];
        }
        let mut pen = Pen::default();
        // Place of the cursor: the index of the cell that the next character replaces.
        let mut cursor = None;
        for (index, (cell, shown)) in cells.iter().zip(&mut self.shown).enumerate() {
            if *shown == Some(*cell) {
                continue;
            }
            if cursor.is_none() {
                out.extend_from_slice(BEGIN_UPDATE);
            }
            // The end of a row is no place to write on from: terminals differ.
            if cursor != Some(index) || index % columns == 0 {
                place(out, index / columns, index % columns);
            }
            pen.draw(cell, self.colors, out);
            *shown = Some(*cell);
            cursor = Some(index + 1);
        }
        if cursor.is_some() {
            out.extend_from_slice(END_UPDATE);
        }
    }
}

impl Pen {
    fn draw(&mut self, cell: &Cell, colors: Colors, out: &mut Vec<u8>) {
        if self.background != Some(cell.background) {
            self.background = Some(cell.background);
            color(out, 48, cell.background, colors);
        }
        // A space has no foreground.
        if cell.glyph != ' ' && self.foreground != Some(cell.foreground) {
            self.foreground = Some(cell.foreground);
            color(out, 38, cell.foreground, colors);
        }
        out.extend_from_slice(cell.glyph.encode_utf8(&mut [0; 4]).as_bytes());
    }
}

/// Moves the cursor to a cell; the terminal counts from 1.
pub(super) fn place(out: &mut Vec<u8>, row: usize, column: usize) {
    // Writing to memory does not fail.
    let _ = write!(out, "\x1b[{};{}H", row + 1, column + 1);
}

fn color(out: &mut Vec<u8>, what: u8, rgb: Rgb, colors: Colors) {
    let _ = match colors {
        Colors::True => {
            let [red, green, blue] = rgb;
            write!(out, "\x1b[{what};2;{red};{green};{blue}m")
        }
        Colors::Indexed => write!(out, "\x1b[{what};5;{}m", indexed(rgb)),
    };
}

/// The nearest of xterm's colours 16 to 255.
fn indexed(rgb: Rgb) -> u8 {
    const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
    let nearest =
        |part: u8| (0..6_u8).min_by_key(|&level| LEVELS[usize::from(level)].abs_diff(part)).unwrap_or(0);
    let cube = rgb.map(nearest);
    let in_cube = cube.map(|level| LEVELS[usize::from(level)]);
    let mean = rgb.iter().map(|&part| u32::from(part)).sum::<u32>() / 3;
    let step = (mean.saturating_sub(3) / 10).min(23) as u8;
    let grey = [8 + 10 * step; 3];
    let distance =
        |shown: Rgb| rgb.iter().zip(shown).map(|(a, b)| u32::from(a.abs_diff(b)).pow(2)).sum::<u32>();
    if distance(grey) < distance(in_cube) { 232 + step } else { 16 + 36 * cube[0] + 6 * cube[1] + cube[2] }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const RED: Rgb = [200, 0, 0];
    const BLUE: Rgb = [0, 0, 200];

    fn text(bytes: &[u8]) -> String {
        String::from_utf8(bytes.to_vec()).unwrap().replace('\x1b', "^")
    }

    #[test]
    fn only_changed_cells_are_written() {
        let half = Cell { glyph: '▀', foreground: RED, background: BLUE };
        let mut cells = vec![Cell::filled(BLUE), half, half, Cell::filled(RED)];
        let (mut encoder, mut out) = (Encoder::new(Colors::True), Vec::new());
        encoder.update(&cells, 2, &mut out);
        let (begin, end) = ("^[?2026h", "^[?2026l");
        let first = "^[1;1H^[48;2;0;0;200m ^[38;2;200;0;0m▀";
        assert_eq!(text(&out), format!("{begin}{first}^[2;1H▀^[48;2;200;0;0m {end}"));
        out.clear();
        encoder.update(&cells, 2, &mut out);
        assert!(out.is_empty());
        cells[1] = Cell::filled(RED);
        encoder.update(&cells, 2, &mut out);
        assert_eq!(text(&out), format!("{begin}^[1;2H^[48;2;200;0;0m {end}"));
        out.clear();
        encoder.forget();
        encoder.update(&cells, 2, &mut out);
        assert!(out.len() > 40);
    }

    #[test]
    fn colours_of_256_are_the_nearest() {
        assert_eq!(indexed([0, 0, 0]), 16);
        assert_eq!(indexed([255, 255, 255]), 231);
        assert_eq!(indexed([255, 0, 0]), 196);
        assert_eq!(indexed([8, 8, 8]), 232);
        assert_eq!(indexed([238, 238, 238]), 255);
        assert_eq!(indexed([94, 136, 174]), 16 + 36 + 6 * 2 + 3);
    }

    fn any_cell() -> impl Strategy<Value = Cell> {
        let rgb = || prop::sample::select(vec![RED, BLUE, [1, 2, 3]]);
        (prop::sample::select(vec![' ', '▀', 'x', '🬀']), rgb(), rgb())
            .prop_map(|(glyph, foreground, background)| Cell { glyph, foreground, background })
    }

    proptest! {
        /// An emulator that reads the bytes of several updates shows the cells of the last one.
        #[test]
        fn an_emulator_shows_the_cells(
            screens in prop::collection::vec(prop::collection::vec(any_cell(), 12), 1..4),
        ) {
            let (columns, rows) = (4_u16, 3_u16);
            let side = |cells| std::num::NonZero::new(cells).unwrap();
            let mut emulator = vt100::Parser::new(side(rows), side(columns), 0);
            let mut encoder = Encoder::new(Colors::True);
            for cells in &screens {
                let mut out = Vec::new();
                encoder.update(cells, columns.into(), &mut out);
                emulator.process(&out);
            }
            for (index, cell) in screens.last().unwrap().iter().enumerate() {
                let (row, column) = (index as u16 / columns, index as u16 % columns);
                let shown = emulator.screen().cell(row, column).unwrap();
                let rgb = |[r, g, b]: Rgb| vt100::Color::Rgb(r, g, b);
                prop_assert_eq!(shown.bgcolor(), rgb(cell.background));
                let glyph = cell.glyph.to_string();
                prop_assert_eq!(shown.contents().trim(), glyph.trim());
                if cell.glyph != ' ' {
                    prop_assert_eq!(shown.fgcolor(), rgb(cell.foreground));
                }
            }
        }
    }
}
