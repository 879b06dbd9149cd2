//! The pixels of a window: pictures, darkened panels and text. Everything is clipped; nothing outside is touched.

use font8x8::UnicodeFonts;

/// Pixels per side of a glyph at scale 1.
pub(super) const GLYPH: usize = 8;

/// A buffer as minifb takes it: `0RGB`, rows from the top, `width * height` pixels.
#[derive(Debug, Default)]
pub(super) struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<u32>,
}

/// A picture as the farm hands it over.
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
    /// From the left.
    pub(super) x: usize,
    /// From the top.
    pub(super) y: usize,
    /// Pixels per row.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
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

    /// Takes the size of the window; what it showed is gone.
    pub(super) fn resize(&mut self, width: usize, height: usize) {
        self.width = width;
        self.height = height;
        self.pixels.resize(width * height, 0);
    }

    /// Fills everything with one colour.
    pub(super) fn fill(&mut self, color: u32) {
        self.pixels.fill(color);
    }

    /// Shows a picture over the whole canvas. One of another size (the window has just been resized) is stretched
    /// without smoothing until the right one arrives.
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
        for (y, row) in self.pixels.chunks_exact_mut(self.width.max(1)).enumerate() {
            let source = y * picture.height / self.height;
            let rgb_row = &picture.rgb[source * picture.width * 3..(source + 1) * picture.width * 3];
            for (x, pixel) in row.iter_mut().enumerate() {
                let source = x * picture.width / self.width * 3;
                *pixel = packed(&rgb_row[source..source + 3]);
            }
        }
    }

    /// Darkens a rectangle to a quarter, so that text on it can be read whatever the picture shows there.
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

    /// Draws one line of text, its top left corner at (`x`, `y`), each dot `scale` pixels wide.
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

/// Rows of dots, the lowest bit leftmost; characters that the font lacks are question marks.
fn glyph(character: char) -> [u8; GLYPH] {
    let fonts = || font8x8::BASIC_FONTS.get(character).or_else(|| font8x8::LATIN_FONTS.get(character));
    fonts().or_else(|| font8x8::BASIC_FONTS.get('?')).unwrap_or([0; GLYPH])
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
        canvas.show(Picture { width: 2, height: 1, rgb: &[1, 1, 1, 2, 2, 2] });
        assert_eq!(canvas.pixels(), [one]);
    }

    #[test]
    fn a_picture_whose_bytes_do_not_fit_is_not_shown() {
        let mut canvas = canvas(2, 2, 7);
        canvas.show(Picture { width: 2, height: 2, rgb: &[0; 11] });
        canvas.show(Picture { width: 0, height: 0, rgb: &[] });
        assert_eq!(canvas.pixels(), [7; 4]);
    }

    #[test]
    fn panels_darken_what_they_cover_and_nothing_else() {
        let mut canvas = canvas(4, 4, 0x00ff_8040);
        canvas.darken(Rect { x: 2, y: 2, width: 9, height: usize::MAX });
        assert_eq!(canvas.pixels()[2 * 4 + 2], 0x003f_2010);
        assert_eq!(canvas.pixels().iter().filter(|&&pixel| pixel == 0x00ff_8040).count(), 12);
        canvas.darken(Rect { x: 50, y: 50, width: 9, height: 9 });
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
