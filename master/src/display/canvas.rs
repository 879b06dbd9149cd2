//! Canvas of a window: pictures, darkened panels and text, all clipped to its size.

use font8x8::UnicodeFonts;
use rayfarm_tracer::image::Resizer;

/// Pixels per side of a glyph at scale 1.
pub(super) const GLYPH: usize = 8;

/// Pixel buffer in minifb's format: `0RGB`, rows from the top, `width * height` pixels.
#[derive(Debug, Default)]
pub(super) struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<u32>,
}

/// A picture in the farm's format.
#[derive(Clone, Copy, Debug)]
pub(super) struct Picture<'a> {
    /// Pixels per row.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
    /// RGB8, rows from the top: `width * height * 3` bytes.
    pub(super) rgb: &'a [u8],
}

/// A rectangle in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rect {
    /// Pixels from the left edge.
    pub(super) x: usize,
    /// Pixels from the top edge.
    pub(super) y: usize,
    /// Pixels per row.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
}

/// Tint of a row of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum RowTint {
    /// No tint.
    #[default]
    None,
    /// Mean of each pixel and this colour.
    Blend(u32),
    /// This colour with the brightness of each pixel.
    Grey(u32),
    /// This colour in place of the pixels: the first row of a segment.
    Edge(u32),
}

impl Canvas {
    /// Pixels per row.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// The pixels, `width * height`.
    pub(super) fn pixels(&self) -> &[u32] {
        &self.pixels
    }

    /// Changes the size, in pixels. The content is undefined afterwards.
    pub(super) fn resize(&mut self, width: usize, height: usize) {
        self.width = width;
        self.height = height;
        self.pixels.resize(width * height, 0);
    }

    /// Fills the canvas with one colour.
    pub(super) fn fill(&mut self, color: u32) {
        self.pixels.fill(color);
    }

    /// Draws a picture over the whole canvas. A picture of another size is resized: it is rendered at a smaller scale, or the
    /// window has just been resized.
    pub(super) fn show(&mut self, picture: Picture<'_>) {
        if picture.rgb.len() != picture.width * picture.height * 3 || picture.rgb.is_empty() {
            return;
        }
        if (picture.width, picture.height) == (self.width, self.height) {
            for (pixel, rgb) in self.pixels.iter_mut().zip(picture.rgb.chunks_exact(3)) {
                *pixel = packed(rgb);
            }
            return;
        }
        let size = |width: usize, height: usize| (side(width), side(height));
        let (from, to) = (size(picture.width, picture.height), size(self.width, self.height));
        let Some(mut resizer) = Resizer::new(from, to) else { return };
        let mut rgb_row = vec![0; self.width * 3];
        for (y, row) in self.pixels.chunks_exact_mut(self.width).enumerate() {
            resizer.row(picture.rgb, y, &mut rgb_row);
            for (pixel, rgb) in row.iter_mut().zip(rgb_row.chunks_exact(3)) {
                *pixel = packed(rgb);
            }
        }
    }

    /// Tints the rows of the picture that covers the canvas. `rows` are those of the picture, from the top.
    pub(super) fn tint(&mut self, rows: &[RowTint]) {
        let height = self.height;
        let mut above = None;
        for (y, pixels) in self.pixels.chunks_exact_mut(self.width.max(1)).enumerate() {
            let source = y * rows.len() / height.max(1);
            // A row that covers several lines has its edge once.
            let repeated = above.replace(source) == Some(source);
            match rows.get(source).copied().unwrap_or_default() {
                RowTint::None => {}
                RowTint::Edge(color) if !repeated => pixels.fill(color),
                RowTint::Blend(color) | RowTint::Edge(color) => {
                    pixels.iter_mut().for_each(|pixel| *pixel = halfway(*pixel, color));
                }
                RowTint::Grey(color) => pixels.iter_mut().for_each(|pixel| *pixel = lit(color, *pixel)),
            }
        }
    }

    /// Fills a rectangle.
    pub(super) fn paint(&mut self, rect: Rect, color: u32) {
        for y in rect.y..rect.y.saturating_add(rect.height).min(self.height) {
            let end = rect.x.saturating_add(rect.width).min(self.width);
            if rect.x < end {
                self.pixels[y * self.width + rect.x..y * self.width + end].fill(color);
            }
        }
    }

    /// Darkens a rectangle to a quarter, so that text on it is legible on any picture.
    pub(super) fn darken(&mut self, rect: Rect) {
        for y in rect.y..rect.y.saturating_add(rect.height).min(self.height) {
            let end = rect.x.saturating_add(rect.width).min(self.width);
            if rect.x >= end {
                return;
            }
            for pixel in &mut self.pixels[y * self.width + rect.x..y * self.width + end] {
                *pixel = (*pixel >> 2) & 0x003f_3f3f;
            }
        }
    }

    /// Draws one line of text with its top left corner at (`x`, `y`) and dots of `scale` pixels.
    pub(super) fn text(&mut self, x: usize, y: usize, scale: usize, color: u32, text: &str) {
        for (index, character) in text.chars().enumerate() {
            let left = x.saturating_add(index.saturating_mul(GLYPH * scale));
            if left >= self.width {
                return;
            }
            self.glyph(left, y, scale, color, character);
        }
    }

    fn glyph(&mut self, x: usize, y: usize, scale: usize, color: u32, character: char) {
        for (row, dots) in glyph(character).into_iter().enumerate() {
            for column in (0..GLYPH).filter(|column| dots >> column & 1 == 1) {
                self.dot(x + column * scale, y + row * scale, scale, color);
            }
        }
    }

    fn dot(&mut self, x: usize, y: usize, side: usize, color: u32) {
        let (right, bottom) = ((x + side).min(self.width), (y + side).min(self.height));
        for row in y..bottom {
            for column in x..right {
                self.pixels[row * self.width + column] = color;
            }
        }
    }
}

/// Converts a side, which fits for all windows and pictures.
fn side(pixels: usize) -> u32 {
    u32::try_from(pixels).unwrap_or(u32::MAX)
}

/// Rows of dots of a character, the lowest bit leftmost. A character that the font lacks is a question mark.
fn glyph(character: char) -> [u8; GLYPH] {
    let fonts = || font8x8::BASIC_FONTS.get(character).or_else(|| font8x8::LATIN_FONTS.get(character));
    fonts().or_else(|| font8x8::BASIC_FONTS.get('?')).unwrap_or([0; GLYPH])
}

/// Mean of two colours.
fn halfway(a: u32, b: u32) -> u32 {
    ((a >> 1) & 0x007f_7f7f) + ((b >> 1) & 0x007f_7f7f)
}

/// A colour at two fifths of its brightness, plus three fifths times the brightness of `pixel`.
fn lit(color: u32, pixel: u32) -> u32 {
    let [_, r, g, b] = pixel.to_be_bytes().map(u32::from);
    // Rec. 601 luma in 256ths, then 0.4 + 0.6 of it.
    let light = 102 + (77 * r + 150 * g + 29 * b) / 256 * 153 / 255;
    let [_, r, g, b] = color.to_be_bytes().map(|channel| (u32::from(channel) * light / 256).min(255) as u8);
    u32::from_be_bytes([0, r, g, b])
}

fn packed(rgb: &[u8]) -> u32 {
    match *rgb {
        [r, g, b] => u32::from_be_bytes([0, r, g, b]),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn canvas(width: usize, height: usize, color: u32) -> Canvas {
        let mut canvas = Canvas::default();
        canvas.resize(width, height);
        canvas.fill(color);
        canvas
    }

    #[test]
    fn a_picture_of_the_same_size_is_copied() {
        let mut canvas = canvas(2, 1, 0);
        canvas.show(Picture { width: 2, height: 1, rgb: &[1, 2, 3, 250, 251, 252] });
        assert_eq!(canvas.pixels(), [0x0001_0203, 0x00fa_fbfc]);
    }

    #[test]
    fn a_picture_of_another_size_fills_the_canvas() {
        let mut canvas = canvas(4, 2, 9);
        canvas.show(Picture { width: 2, height: 1, rgb: &[1, 1, 1, 2, 2, 2] });
        let (one, two) = (0x0001_0101, 0x0002_0202);
        assert_eq!(canvas.pixels(), [one, one, two, two, one, one, two, two]);
        canvas.resize(1, 1);
        canvas.show(Picture { width: 2, height: 1, rgb: &[1, 1, 1, 3, 3, 3] });
        assert_eq!(canvas.pixels(), [two]);
        canvas.resize(0, 0);
        canvas.show(Picture { width: 2, height: 1, rgb: &[1, 1, 1, 3, 3, 3] });
    }

    #[test]
    fn a_picture_whose_bytes_do_not_fit_is_not_drawn() {
        let mut canvas = canvas(2, 2, 7);
        canvas.show(Picture { width: 2, height: 2, rgb: &[0; 11] });
        canvas.show(Picture { width: 0, height: 0, rgb: &[] });
        assert_eq!(canvas.pixels(), [7; 4]);
    }

    #[test]
    fn panels_darken_only_their_rectangle() {
        let mut canvas = canvas(4, 4, 0x00ff_8040);
        canvas.darken(Rect { x: 2, y: 2, width: 9, height: usize::MAX });
        assert_eq!(canvas.pixels()[2 * 4 + 2], 0x003f_2010);
        assert_eq!(canvas.pixels().iter().filter(|&&pixel| pixel == 0x00ff_8040).count(), 12);
        canvas.darken(Rect { x: 50, y: 50, width: 9, height: 9 });
    }

    #[test]
    fn tints_follow_the_rows_of_the_picture() {
        let mut canvas = canvas(2, 4, 0x0010_2030);
        canvas.tint(&[RowTint::Edge(0x00ff_0000), RowTint::Blend(0x0010_2032)]);
        let rows: Vec<u32> = canvas.pixels().chunks(2).map(|row| row[0]).collect();
        assert_eq!(rows, [0x00ff_0000, 0x0087_1018, 0x0010_2031, 0x0010_2031]);
        canvas.fill(0x00ff_ffff);
        canvas.tint(&[RowTint::Grey(0x0080_4020), RowTint::None]);
        assert_eq!([canvas.pixels()[0], canvas.pixels()[7]], [0x007f_3f1f, 0x00ff_ffff]);
        canvas.tint(&[]);
        assert_eq!(canvas.pixels()[7], 0x00ff_ffff);
    }

    #[test]
    fn paint_stays_inside() {
        let mut canvas = canvas(3, 3, 0);
        canvas.paint(Rect { x: 1, y: 1, width: 1, height: usize::MAX }, 5);
        canvas.paint(Rect { x: 7, y: 0, width: 9, height: 9 }, 6);
        assert_eq!(canvas.pixels(), [0, 0, 0, 0, 5, 0, 0, 5, 0]);
    }

    #[test]
    fn text_is_as_the_font_draws_it() {
        let mut canvas = canvas(16, 16, 0);
        canvas.text(0, 0, 2, 1, "T");
        // The bar of a T: its upper row is dark from dot 0 to 5 in this font.
        let rows: Vec<String> = canvas
            .pixels()
            .chunks(16)
            .step_by(2)
            .map(|row| row.iter().step_by(2).map(|&dot| if dot == 1 { '#' } else { '.' }).collect())
            .collect();
        assert_eq!(
            rows,
            ["######..", "#.##.#..", "..##....", "..##....", "..##....", "..##....", ".####...", "........"]
        );
    }

    #[test]
    fn unknown_characters_are_question_marks() {
        let mut unknown = canvas(8, 8, 0);
        unknown.text(0, 0, 1, 1, "\u{1F600}");
        let mut question = canvas(8, 8, 0);
        question.text(0, 0, 1, 1, "?");
        assert_eq!(unknown.pixels(), question.pixels());
    }

    #[test]
    fn text_that_leaves_the_canvas_is_clipped() {
        for (width, height) in [(1, 1), (5, 3), (9, 100), (0, 0)] {
            let mut canvas = canvas(width, height, 0);
            canvas.text(0, 0, 3, 1, "wide and tall");
            canvas.text(7, 2, 2, 1, "off");
            canvas.text(usize::MAX - 1, usize::MAX - 40, 1, 1, "far");
        }
    }
}
