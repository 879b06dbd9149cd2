//! Legend of the colours over the picture.

use super::{GLYPH, LINE, MARGIN, Panel, WHITE};
use crate::display::canvas::{Canvas, Rect};

/// Largest number of colours in the legend.
const MAX_ENTRIES: usize = 16;
/// Characters of a label.
const MAX_LABEL: usize = 20;

/// A colour and its meaning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::display) struct Entry {
    pub(in crate::display) color: u32,
    pub(in crate::display) label: String,
}

/// Draws the legend in the upper right corner.
pub(super) fn draw_legend(canvas: &mut Canvas, title: &str, entries: &[Entry]) {
    let mut lines = vec![title.to_owned()];
    let cut = |label: &str| label.chars().take(MAX_LABEL).collect::<String>();
    lines.extend(entries.iter().take(MAX_ENTRIES).map(|entry| format!("   {}", cut(&entry.label))));
    if entries.len() > MAX_ENTRIES {
        lines.push(format!("   {} more", entries.len() - MAX_ENTRIES));
    }
    let panel = Panel::fit(canvas, &lines);
    let scale = panel.scale;
    let x = canvas.width().saturating_sub(panel.width() + MARGIN * scale);
    let y = MARGIN * scale;
    panel.draw_in(canvas, x, y, |_| WHITE);
    if panel.lines.len() != lines.len() {
        return; // lines were broken, so the swatches would be next to other lines
    }
    for (index, entry) in entries.iter().take(MAX_ENTRIES).enumerate() {
        let top = y + (MARGIN + (index + 1) * LINE) * scale;
        let swatch = Rect { x: x + MARGIN * scale, y: top, width: 2 * GLYPH * scale, height: GLYPH * scale };
        canvas.paint(swatch, entry.color);
    }
}
