//! The pixels of a finished frame.

use std::fmt;
use std::ops::Deref;
use std::sync::Weak;

use super::Framebuffers;

/// The pixels of a finished frame, as `&[u8]`. Their memory is used for a later frame when they are dropped.
pub struct FramePixels {
    pub(super) bytes: Vec<u8>,
    pub(super) home: Weak<Framebuffers>,
}

impl FramePixels {
    /// The bytes, without a copy. Their memory does not return to the farm.
    pub fn into_vec(mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
    }
}

impl From<Vec<u8>> for FramePixels {
    /// Pixels that were made elsewhere, such as those of a picture from several frames.
    fn from(bytes: Vec<u8>) -> Self {
        Self { bytes, home: Weak::new() }
    }
}

impl Deref for FramePixels {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes
    }
}

impl fmt::Debug for FramePixels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FramePixels({} bytes)", self.bytes.len())
    }
}

impl Drop for FramePixels {
    fn drop(&mut self) {
        if let Some(home) = self.home.upgrade().filter(|_| !self.bytes.is_empty()) {
            home.keep_spare(std::mem::take(&mut self.bytes));
        }
    }
}
