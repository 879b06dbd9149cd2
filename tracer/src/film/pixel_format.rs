//! The format of a frame's pixels.

use crate::frame::PreparedFrame;
use crate::scene::PixelFormat;

impl PreparedFrame {
    /// Format of the pixels that rendering writes.
    pub fn pixel_format(&self) -> PixelFormat {
        self.view().format
    }

    /// Bytes of a row of the frame.
    pub fn row_bytes(&self) -> usize {
        self.pixel_format().row_bytes(self.width())
    }
}
