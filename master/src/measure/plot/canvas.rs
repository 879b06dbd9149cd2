//! RGB picture as a backend of `plotters`, with letters of its own: no system font is needed.

use std::convert::Infallible;

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, RasterizedChar, get_raster, get_raster_width};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};
use rayfarm_tracer::image::RgbImage;

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// Picture with a white background. Lines and discs are anti-aliased.
pub(super) struct Canvas {
    picture: RgbImage,
}

impl Canvas {
    pub(super) fn new((width, height): (u32, u32)) -> Self {
        let bytes = width as usize * height as usize * 3;
        Self { picture: RgbImage { width, height, pixels: vec![255; bytes] } }
    }

    pub(super) fn into_picture(self) -> RgbImage {
        self.picture
    }

    /// Blends a colour over a pixel by its coverage, 0 to 1; pixels outside the picture are ignored.
    fn blend(&mut self, (x, y): BackendCoord, color: BackendColor, coverage: f64) {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        if x >= self.picture.width || y >= self.picture.height {
            return;
        }
        let alpha = (color.alpha * coverage).clamp(0.0, 1.0);
        let at = (y as usize * self.picture.width as usize + x as usize) * 3;
        let (red, green, blue) = color.rgb;
        for (byte, new) in self.picture.pixels[at..at + 3].iter_mut().zip([red, green, blue]) {
            *byte = (f64::from(*byte) * (1.0 - alpha) + f64::from(new) * alpha).round() as u8;
        }
    }

    /// Fills the pixels of a box by the signed distance of their centres, negative inside.
    fn cover(
        &mut self,
        [left, top, right, bottom]: [i32; 4],
        color: BackendColor,
        distance: impl Fn(f64, f64) -> f64,
    ) {
        for y in top.max(0)..=bottom.min(self.picture.height as i32 - 1) {
            for x in left.max(0)..=right.min(self.picture.width as i32 - 1) {
                let coverage = (0.5 - distance(f64::from(x), f64::from(y))).clamp(0.0, 1.0);
                if coverage > 0.0 {
                    self.blend((x, y), color, coverage);
                }
            }
        }
    }
}

impl DrawingBackend for &mut Canvas {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.picture.width, self.picture.height)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Drawn {
        self.blend(point, color, 1.0);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        let radius = f64::from(style.stroke_width()) / 2.0;
        let around = radius.ceil() as i32 + 1;
        let area = [
            from.0.min(to.0) - around,
            from.1.min(to.1) - around,
            from.0.max(to.0) + around,
            from.1.max(to.1) + around,
        ];
        self.cover(area, style.color(), |x, y| distance_to_segment(x, y, from, to) - radius);
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let points: Vec<BackendCoord> = path.into_iter().collect();
        points.windows(2).try_for_each(|ends| self.draw_line(ends[0], ends[1], style))
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let half_width = f64::from(style.stroke_width()) / 2.0;
        let around = radius as i32 + style.stroke_width() as i32 + 1;
        let area = [center.0 - around, center.1 - around, center.0 + around, center.1 + around];
        self.cover(area, style.color(), |x, y| {
            let outside = (x - f64::from(center.0)).hypot(y - f64::from(center.1)) - f64::from(radius);
            if fill { outside } else { outside.abs() - half_width }
        });
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let face = face(style.size());
        let (width, height) = extent(text, face);
        let dx = match style.anchor().h_pos {
            HPos::Left => 0,
            HPos::Right => -width,
            HPos::Center => -width / 2,
        };
        let dy = match style.anchor().v_pos {
            VPos::Top => 0,
            VPos::Center => -height / 2,
            VPos::Bottom => -height,
        };
        let advance = get_raster_width(FontWeight::Regular, face) as i32;
        for (index, letter) in (0..).zip(text.chars()) {
            let Some(raster) = letter_raster(letter, face) else { continue };
            for (y, row) in (0..).zip(raster.rows()) {
                for (x, intensity) in (0..).zip(row) {
                    let (x, y) = style.transform().transform(dx + index * advance + x, dy + y);
                    self.blend((at.0 + x, at.1 + y), style.color(), f64::from(*intensity) / 255.0);
                }
            }
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let (width, height) = extent(text, face(style.size()));
        Ok((width.unsigned_abs(), height.unsigned_abs()))
    }
}

fn distance_to_segment(x: f64, y: f64, from: BackendCoord, to: BackendCoord) -> f64 {
    let (x, y) = (x - f64::from(from.0), y - f64::from(from.1));
    let (along_x, along_y) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
    let length_squared = along_x * along_x + along_y * along_y;
    let share = if length_squared > 0.0 { (x * along_x + y * along_y) / length_squared } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    (x - share * along_x).hypot(y - share * along_y)
}

/// The raster font nearest to a size in units of `plotters`; an SVG font of that size has size / 1.24 pixels.
fn face(size: f64) -> RasterHeight {
    match size {
        ..20.0 => RasterHeight::Size20,
        20.0..26.0 => RasterHeight::Size24,
        _ => RasterHeight::Size32,
    }
}

/// Width and height of a line of text, in pixels.
fn extent(text: &str, face: RasterHeight) -> (i32, i32) {
    let advance = get_raster_width(FontWeight::Regular, face);
    ((text.chars().count() * advance) as i32, face.val() as i32)
}

fn letter_raster(letter: char, face: RasterHeight) -> Option<RasterizedChar> {
    let raster = |letter| get_raster(letter, FontWeight::Regular, face);
    raster(letter).or_else(|| raster('?'))
}
