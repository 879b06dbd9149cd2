//! GIF: 255 colours for each frame, dithered. Pixels that do not change keep their colours, so objects at rest do not flicker and
//! take no bytes.

use std::borrow::Cow;
use std::fs::File;
use std::io::{BufWriter, Write};

use gif::{Frame, Repeat};
use rayfarm_tracer::image::RgbImage;

use super::palette::Palette;
use super::{Encoder, VideoError, VideoSettings};
use crate::viewer::VideoRate;

/// Shortest time of a frame, in seconds: programs show shorter ones for a tenth of a second.
const MIN_DELAY: f64 = 0.02;

/// An encoder of GIF.
pub(super) struct GifEncoder {
    encoder: gif::Encoder<BufWriter<File>>,
    rate: VideoRate,
    /// Number of frames so far.
    frames: u64,
    last: Option<RgbImage>,
}

/// The part of a picture that differs from the previous one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Change {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
}

impl GifEncoder {
    pub(super) fn new(file: File, settings: &VideoSettings) -> Result<Self, VideoError> {
        let VideoSettings { width, height, rate, .. } = *settings;
        // Not by the rounded delay of one frame: at 60 frames per second, delays of one and two hundredths would alternate.
        if rate.time(1) < MIN_DELAY {
            return Err(VideoError::new(format!(
                "a GIF has at most 50 frames per second, not {rate}: give --fps 50 or less, or write an .apng"
            )));
        }
        let side = |pixels: u32| u16::try_from(pixels).map_err(|error| VideoError::of(&error));
        let file = BufWriter::new(file);
        let encoder = gif::Encoder::new(file, side(width)?, side(height)?, &[]);
        let mut encoder = encoder.map_err(|error| VideoError::of(&error))?;
        encoder.set_repeat(Repeat::Infinite).map_err(|error| VideoError::of(&error))?;
        Ok(Self { encoder, rate, frames: 0, last: None })
    }
}

impl Encoder for GifEncoder {
    fn add(&mut self, frame: &RgbImage) -> Result<(), VideoError> {
        let last = self.last.as_ref().map(|last| last.pixels.as_slice());
        let change = change(frame, last);
        let rows = change.top..change.top + change.height;
        let columns = change.left..change.left + change.width;
        let places = || rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y)));
        let color = |(x, y): (usize, usize)| color_at(&frame.pixels, frame.width, x, y);
        let is_new = |&(x, y): &(usize, usize)| {
            last.is_none_or(|last| color_at(last, frame.width, x, y) != color((x, y)))
        };
        let mut palette = Palette::of(places().filter(is_new).map(color));
        let transparent = palette.unused();
        let pixel = |place: (usize, usize)| match is_new(&place) {
            true => palette.index(color(place), place),
            false => transparent,
        };
        let buffer: Vec<u8> = places().map(pixel).collect();
        let delay = self.rate.hundredths(self.frames + 1) - self.rate.hundredths(self.frames);
        let picture = Frame {
            // At most 1000 hundredths; the sides of a change are those of the picture, which fit. A frame remains below the next
            // one, as by default.
            delay: delay as u16,
            transparent: last.is_some().then_some(transparent),
            top: change.top as u16,
            left: change.left as u16,
            width: change.width as u16,
            height: change.height as u16,
            palette: Some(palette.bytes()),
            buffer: Cow::Owned(buffer),
            ..Frame::default()
        };
        self.encoder.write_frame(&picture).map_err(|error| VideoError::of(&error))?;
        self.frames += 1;
        self.last = Some(frame.clone());
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<(), VideoError> {
        let mut file = self.encoder.into_inner().map_err(|error| VideoError::of(&error))?;
        file.flush().map_err(|error| VideoError::of(&error))
    }
}

fn color_at(pixels: &[u8], width: u32, x: usize, y: usize) -> [u8; 3] {
    let first = 3 * (y * width as usize + x);
    pixels.get(first..first + 3).and_then(|color| color.try_into().ok()).unwrap_or_default()
}

/// The smallest rectangle with all changes; a single pixel where nothing has changed.
fn change(frame: &RgbImage, last: Option<&[u8]>) -> Change {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let Some(last) = last else { return Change { left: 0, top: 0, width, height } };
    let (mut left, mut right, mut top, mut bottom) = (width, 0, height, 0);
    let rows = frame.pixels.chunks_exact(3 * width.max(1)).zip(last.chunks_exact(3 * width.max(1)));
    for (y, (row, before)) in rows.enumerate().filter(|(_, (row, before))| row != before) {
        let differs = |x: &usize| row.get(3 * x..3 * x + 3) != before.get(3 * x..3 * x + 3);
        left = left.min((0..width).find(differs).unwrap_or(width));
        right = right.max((0..width).rfind(differs).map_or(0, |x| x + 1));
        (top, bottom) = (top.min(y), y + 1);
    }
    match bottom {
        0 => Change { left: 0, top: 0, width: 1, height: 1 },
        _ => Change { left, top, width: right - left, height: bottom - top },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_the_smallest_rectangle() {
        let still = RgbImage::new(5, 4);
        assert_eq!(change(&still, None), Change { left: 0, top: 0, width: 5, height: 4 });
        assert_eq!(change(&still, Some(&still.pixels)), Change { left: 0, top: 0, width: 1, height: 1 });
        let mut moved = still.clone();
        moved.pixels[3 * (5 + 3)] = 1;
        moved.pixels[3 * (2 * 5 + 1) + 2] = 9;
        assert_eq!(change(&moved, Some(&still.pixels)), Change { left: 1, top: 1, width: 3, height: 2 });
    }
}
