//! Decoding of pixels: from the bytes of a lease, in any encoding, to its rows in the frame's format.

use std::ops::Deref;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::Bytes;
use rayfarm_protocol::pixels::{BlockError, from_rgb565, rgb565_bytes, unpack, unpack_planes};
use rayfarm_protocol::{Encoding, Lease, PixelFormat};

/// Buffers kept for later segments. Each decoding in progress uses one or two more.
const SPARE_BUFFERS: usize = 8;

/// An error of pixels that do not fit their lease.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Misfit {
    #[error("{lease} takes {expected} bytes of pixels, {got} arrived")]
    Bytes { lease: Lease, expected: usize, got: usize },
    #[error("{lease}: {source}")]
    Blocks { lease: Lease, source: BlockError },
    #[error("{lease}: pixels of the format {format:?} are not sent as {encoding:?}")]
    Encoding { lease: Lease, format: PixelFormat, encoding: Encoding },
    #[error("{lease} has rows outside of the picture of {rows} rows")]
    Rows { lease: Lease, rows: usize },
}

/// The decoded rows of one segment, without gaps. Clones share the bytes.
#[derive(Clone, Debug)]
pub(crate) struct DecodedRows(Storage);

#[derive(Clone, Debug)]
enum Storage {
    /// Raw pixels stay where they were received.
    Received(Bytes),
    /// The first bytes of a buffer; the number is their count.
    Buffer(Arc<Vec<u8>>, usize),
}

impl Deref for DecodedRows {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match &self.0 {
            Storage::Received(bytes) => bytes,
            Storage::Buffer(buffer, len) => buffer.get(..*len).unwrap_or_default(),
        }
    }
}

/// Decodes segments, any number at once. It holds its lock only to take buffers out and put them back.
#[derive(Default)]
pub(super) struct Decoder {
    spare: Mutex<Vec<Vec<u8>>>,
    #[cfg(test)]
    hook: std::sync::OnceLock<Box<dyn Fn() + Send + Sync>>,
}

impl Decoder {
    /// Decodes the pixels of a lease to `size` bytes in a format.
    ///
    /// # Errors
    /// The pixels decode to another number of bytes, or not at all, or their encoding is not one of the format.
    pub(super) fn decode(
        &self,
        lease: Lease,
        format: PixelFormat,
        size: usize,
        encoding: Encoding,
        bytes: &Bytes,
    ) -> Result<DecodedRows, Misfit> {
        #[cfg(test)]
        self.hook.get().into_iter().for_each(|hook| hook());
        if !format.allows(encoding) {
            return Err(Misfit::Encoding { lease, format, encoding });
        }
        let misfit = |expected| Misfit::Bytes { lease, expected, got: bytes.len() };
        let invalid = |source| Misfit::Blocks { lease, source };
        let narrow = rgb565_bytes(size);
        let widened = |from: &[u8], rows: &mut [u8]| {
            from_rgb565(from, rows).then_some(()).ok_or_else(|| misfit(narrow))
        };
        match encoding {
            Encoding::Raw if bytes.len() == size => Ok(DecodedRows(Storage::Received(bytes.clone()))),
            Encoding::Raw => Err(misfit(size)),
            Encoding::Lz4 => self.fill_buffer(size, |rows| unpack(bytes, rows).map_err(invalid)),
            Encoding::PlanesLz4 => {
                let mut planes = self.take(size);
                let pixel = format.bytes_per_pixel();
                let rows = self.fill_buffer(size, |rows| {
                    unpack_planes(bytes, rows, pixel, &mut planes).map_err(invalid)
                });
                self.keep(planes);
                rows
            }
            Encoding::Rgb565 => self.fill_buffer(size, |rows| widened(bytes, rows)),
            Encoding::Rgb565Lz4 => {
                let unpacked = self.fill_buffer(narrow, |pixels| unpack(bytes, pixels).map_err(invalid))?;
                let rows = self.fill_buffer(size, |rows| widened(&unpacked, rows));
                self.recycle(unpacked);
                rows
            }
        }
    }

    /// Takes a buffer and has `fill` write its first `size` bytes, all of them unless it fails.
    fn fill_buffer(
        &self,
        size: usize,
        fill: impl FnOnce(&mut [u8]) -> Result<(), Misfit>,
    ) -> Result<DecodedRows, Misfit> {
        let mut buffer = self.take(size);
        let filled = fill(buffer.get_mut(..size).unwrap_or_default());
        let rows = DecodedRows(Storage::Buffer(Arc::new(buffer), size));
        match filled {
            Ok(()) => Ok(rows),
            Err(misfit) => {
                self.recycle(rows);
                Err(misfit)
            }
        }
    }

    /// Takes the buffer of decoded rows back, unless a clone of them is still in use.
    pub(super) fn recycle(&self, rows: DecodedRows) {
        if let Storage::Buffer(buffer, _) = rows.0 {
            Arc::try_unwrap(buffer).into_iter().for_each(|buffer| self.keep(buffer));
        }
    }

    /// A buffer of at least `size` bytes, with unspecified content.
    fn take(&self, size: usize) -> Vec<u8> {
        let mut buffer = self.spare().pop().unwrap_or_default();
        if buffer.len() < size {
            // The operating system provides zeroed pages on first access, whereas resizing would write them all.
            buffer = vec![0; size];
        }
        buffer
    }

    fn keep(&self, buffer: Vec<u8>) {
        let mut spare = self.spare();
        if spare.len() < SPARE_BUFFERS {
            spare.push(buffer);
        }
    }

    fn spare(&self) -> MutexGuard<'_, Vec<Vec<u8>>> {
        self.spare.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets a function that is called at the start of each decoding.
    #[cfg(test)]
    pub(super) fn on_decode(&self, hook: impl Fn() + Send + Sync + 'static) {
        assert!(self.hook.set(Box::new(hook)).is_ok(), "the hook is set once");
    }
}
