//! Animated PNG: every frame as it was rendered.

use std::fs::File;
use std::io::BufWriter;

use png::{BitDepth, ColorType, Writer};
use rayfarm_tracer::image::RgbImage;

use super::{Encoder, VideoError, VideoSettings};

/// An encoder of animated PNG.
pub(super) struct ApngEncoder(Writer<BufWriter<File>>);

impl ApngEncoder {
    pub(super) fn new(file: File, settings: &VideoSettings) -> Result<Self, VideoError> {
        let VideoSettings { width, height, frames, rate, .. } = *settings;
        let mut encoder = png::Encoder::new(BufWriter::new(file), width, height);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        let (seconds, parts) = rate.delay();
        // 0 is repetition without end.
        encoder.set_animated(frames, 0).map_err(|error| VideoError::of(&error))?;
        encoder.set_frame_delay(seconds, parts).map_err(|error| VideoError::of(&error))?;
        encoder.validate_sequence(true);
        encoder.write_header().map(Self).map_err(|error| VideoError::of(&error))
    }
}

impl Encoder for ApngEncoder {
    fn add(&mut self, frame: &RgbImage) -> Result<(), VideoError> {
        self.0.write_image_data(&frame.pixels).map_err(|error| VideoError::of(&error))
    }

    fn finish(self: Box<Self>) -> Result<(), VideoError> {
        self.0.finish().map_err(|error| VideoError::of(&error))
    }
}
