//! Text on the terminal: the panel below the picture, messages and the list of keys.

use std::time::Duration;

use rayfarm_farm::FarmStatus;

use super::cells::{Cell, Rgb};
use crate::display::numbers::{counted, three_digits};
use crate::viewer::{PresentedFrame, Statistics};

const TEXT: Rgb = [236, 236, 236];
const SOFT: Rgb = [160, 168, 176];
const GROUND: Rgb = [24, 27, 31];

/// Lines of a fault that are shown; the log has all of it.
const MAX_FAULT_LINES: usize = 6;

/// Rows of the panel.
pub(super) const PANEL_ROWS: usize = 2;

/// Keys, and the effect of each.
const KEYS: [(&str, &str); 12] = [
    ("W A S D", "move (Shift: twice as far)"),
    ("Q E", "move down, up"),
    ("arrows", "look around"),
    (", .", "roll left, right"),
    ("drag", "orbit"),
    ("wheel", "nearer, farther"),
    ("+ -", "zoom (or page up, page down)"),
    ("R", "back to the start"),
    ("O", "hide the panel"),
    ("P", "pause, resume all workers"),
    ("B", "bring kicked workers back"),
    ("Esc", "end"),
];

/// Cells of the whole screen, on which text is written.
#[derive(Debug)]
pub(super) struct Screen<'a> {
    pub(super) cells: &'a mut [Cell],
    pub(super) columns: usize,
}

impl Screen<'_> {
    /// Writes text from a place on, as far as the row reaches. Characters that are not one column wide are replaced.
    fn write(&mut self, row: usize, column: usize, text: &str, foreground: Rgb) {
        let start = row * self.columns;
        let Some(cells) = self.cells.get_mut(start + column.min(self.columns)..start + self.columns) else {
            return;
        };
        for (cell, letter) in cells.iter_mut().zip(text.chars()) {
            let is_narrow =
                letter == ' ' || letter.is_ascii_graphic() || ('\u{a1}'..='\u{24f}').contains(&letter);
            *cell = Cell { glyph: if is_narrow { letter } else { '?' }, foreground, background: GROUND };
        }
    }

    /// Writes the panel into the last rows: figures, and the last line of the log.
    pub(super) fn panel(&mut self, figures: &str, log: &str) {
        let rows = self.cells.len() / self.columns.max(1);
        let Some(first) = rows.checked_sub(PANEL_ROWS) else { return };
        for cell in self.cells.iter_mut().skip(first * self.columns) {
            *cell = Cell::filled(GROUND);
        }
        self.write(first, 1, figures, TEXT);
        self.write(first + 1, 1, log, SOFT);
    }

    /// Writes lines in the middle.
    pub(super) fn message(&mut self, lines: &[String]) {
        let rows = self.cells.len() / self.columns.max(1);
        let width = lines.iter().map(|line| line.chars().count()).max().unwrap_or(0);
        let column = self.columns.saturating_sub(width) / 2;
        let first = rows.saturating_sub(lines.len()) / 2;
        for (row, line) in (first..rows).zip(lines) {
            self.write(row, column.saturating_sub(1), &format!(" {line:width$} "), TEXT);
        }
    }
}

/// The message about a fault in the files of the scene, in lines of at most `columns` characters.
pub(super) fn scene_fault(fault: &str, columns: usize) -> Vec<String> {
    let mut lines = vec!["The scene has a fault and is shown as it was before:".to_owned()];
    let characters: Vec<char> = fault.chars().collect();
    let pieces = characters.chunks(columns.saturating_sub(4).max(8)).take(MAX_FAULT_LINES);
    lines.extend(pieces.map(|piece| piece.iter().collect()));
    lines
}

/// The list of keys.
pub(super) fn keys() -> Vec<String> {
    let widest = KEYS.iter().map(|(keys, _)| keys.len()).max().unwrap_or(0);
    KEYS.iter().map(|(keys, effect)| format!("{keys:widest$}  {effect}")).collect()
}

/// The line of figures: rate, time of a frame, size, samples, workers.
pub(super) fn figures(
    picture: Option<&PresentedFrame>,
    statistics: &Statistics,
    status: &FarmStatus,
) -> String {
    let ms = |time: Duration| format!("{} ms", three_digits(time.as_secs_f64() * 1e3));
    let mut parts = Vec::new();
    if let Some(picture) = picture {
        let rate = if statistics.resting {
            "at rest".to_owned()
        } else {
            format!("{} FPS", three_digits(statistics.fps))
        };
        parts.push(format!("{rate}  {}", ms(statistics.frame_time)));
        let view = picture.frame.view;
        parts.push(format!("{} x {}", view.width, view.height));
        match &picture.film {
            Some(film) => parts.push(film.text()),
            None if view.samples > 1 => parts.push(format!("{} samples", view.samples)),
            None => {}
        }
        parts.extend(statistics.quality.iter().cloned());
    }
    parts.push(counted(status.workers.len() as u64, "worker"));
    parts.push("H: keys".to_owned());
    parts.join("  |  ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(cells: &[Cell], columns: usize) -> Vec<String> {
        cells.chunks(columns).map(|row| row.iter().map(|cell| cell.glyph).collect()).collect()
    }

    #[test]
    fn text_stays_inside_its_row() {
        let mut cells = vec![Cell::filled([1; 3]); 8 * 4];
        let mut screen = Screen { cells: &mut cells, columns: 8 };
        screen.panel("a long line of figures", "log \u{7}\u{1F600}");
        assert_eq!(
            text(&cells, 8),
            ["        ", "        ", " a long ", " log ??  "[..8].to_owned().as_str()]
        );
        let mut screen = Screen { cells: &mut cells, columns: 8 };
        screen.message(&["one".to_owned(), "three".to_owned()]);
        assert_eq!(text(&cells, 8)[1], " one    "[..8]);
    }

    #[test]
    fn a_screen_without_room_shows_no_panel() {
        let mut cells = vec![Cell::filled([1; 3]); 3];
        Screen { cells: &mut cells, columns: 3 }.panel("figures", "log");
        assert_eq!(text(&cells, 3), ["   "]);
        Screen { cells: &mut cells, columns: 3 }.message(&keys());
    }
}
