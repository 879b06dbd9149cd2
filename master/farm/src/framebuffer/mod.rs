//! Framebuffers: one picture per frame in flight, filled by sessions in the order in which segments arrive.
//!
//! Pixels are decoded outside of the lock, so any number of sessions decode at once. The lock is held only to copy decoded
//! rows into a picture.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfarm_protocol::{Encoding, FrameId, Lease, PixelFormat};
use rayfarm_scheduler::WorkerId;

mod canvas;
mod decode;
mod frame_pixels;

use canvas::Canvas;
use decode::Decoder;

pub(crate) use decode::{DecodedRows, Misfit};
pub use frame_pixels::FramePixels;

/// Picture buffers kept for later frames: two in flight and one on the screen.
const SPARE_BUFFERS: usize = 3;
/// Rejected workers that are remembered. Each one's last segments arrive long before the list is full.
const MAX_REJECTED: usize = 1024;

/// The pictures of all frames in flight. Pixels of other frames are dropped, so those of a superseded frame reach no
/// picture.
#[derive(Default)]
pub(crate) struct Framebuffers {
    inner: Mutex<Inner>,
    decoder: Decoder,
}

#[derive(Debug, Default)]
struct Inner {
    open: BTreeMap<FrameId, Canvas>,
    /// Workers whose pixels are dropped.
    rejected: VecDeque<WorkerId>,
    spare: Vec<Vec<u8>>,
}

/// Outcome of writing the pixels of a segment.
#[derive(Clone, Debug)]
pub(crate) enum Written {
    /// The rows are in the picture, or the picture had them already.
    Kept {
        /// The decoded rows; give them back to [`Framebuffers::recycle`].
        rows: DecodedRows,
        /// Whether all of them are in the picture: it had none of these rows before.
        all_new: bool,
        /// Time for decoding and copying.
        elapsed: Duration,
    },
    /// The frame is not open, or the worker is rejected: the pixels are dropped.
    Superseded,
}

impl Framebuffers {
    /// Opens a frame of `width * height` pixels in a format. A spare buffer is not cleared: every row is written before the picture is
    /// handed out.
    pub(crate) fn open(&self, frame: FrameId, width: u32, height: u32, format: PixelFormat) {
        let (row_bytes, rows) = (format.row_bytes(width), height as usize);
        let mut inner = self.lock();
        let mut pixels = inner.spare.pop().unwrap_or_default();
        if pixels.len() != row_bytes * rows {
            // The operating system provides zeroed pages on first access, whereas resizing would write them all.
            pixels = vec![0; row_bytes * rows];
        }
        inner.open.insert(frame, Canvas::new(pixels, format, row_bytes, rows));
    }

    /// Decodes the pixels of a lease and copies them into its picture. Rows that have pixels keep them. Only the copying
    /// holds the lock.
    ///
    /// # Errors
    /// The pixels do not fit the lease, or the lease does not fit the picture; no row is written.
    pub(crate) fn write(
        &self,
        from: WorkerId,
        lease: Lease,
        encoding: Encoding,
        bytes: &Bytes,
    ) -> Result<Written, Misfit> {
        let Some((format, size)) =
            self.lock().canvas(from, lease.frame).map(|canvas| (canvas.format, canvas.bytes_of(lease)))
        else {
            return Ok(Written::Superseded);
        };
        let started = Instant::now();
        let rows = self.decode(lease, format, size?, encoding, bytes)?;
        let decoding = started.elapsed();
        let mut inner = self.lock();
        // Meanwhile the frame may have been closed and the worker rejected.
        let Some(canvas) = inner.canvas(from, lease.frame) else {
            drop(inner);
            self.recycle(rows);
            return Ok(Written::Superseded);
        };
        let started = Instant::now();
        let all_new = canvas.write(from, lease, &rows)?;
        Ok(Written::Kept { rows, all_new, elapsed: decoding + started.elapsed() })
    }

    /// Decodes the pixels of a lease: `size` bytes of rows in a format. Takes no lock of the pictures.
    ///
    /// # Errors
    /// The pixels do not fit the lease, or their encoding is not one of the format.
    pub(crate) fn decode(
        &self,
        lease: Lease,
        format: PixelFormat,
        size: usize,
        encoding: Encoding,
        bytes: &Bytes,
    ) -> Result<DecodedRows, Misfit> {
        self.decoder.decode(lease, format, size, encoding, bytes)
    }

    /// Takes the memory of decoded rows back for later segments.
    pub(crate) fn recycle(&self, rows: DecodedRows) {
        self.decoder.recycle(rows);
    }

    /// Whether all rows of a lease are in the picture with this worker's pixels.
    pub(crate) fn is_all_of(&self, worker: WorkerId, lease: Lease) -> bool {
        self.lock().open.get(&lease.frame).is_some_and(|canvas| canvas.is_all_of(worker, lease))
    }

    /// A copy of the rows of a lease, if all of them are in the picture with this worker's pixels.
    pub(crate) fn copy_of(&self, worker: WorkerId, lease: Lease) -> Option<Vec<u8>> {
        self.lock().open.get(&lease.frame)?.copy_of(worker, lease)
    }

    /// Removes a worker's rows from all pictures, and drops its pixels from now on. Returns the rows that are missing now.
    pub(crate) fn reject(&self, worker: WorkerId) -> Vec<(FrameId, Range<u32>)> {
        let mut inner = self.lock();
        if !inner.rejected.contains(&worker) {
            inner.rejected.push_back(worker);
        }
        while inner.rejected.len() > MAX_REJECTED {
            inner.rejected.pop_front();
        }
        let canvases = inner.open.iter_mut();
        canvases.flat_map(|(&frame, canvas)| canvas.reject(worker).map(move |rows| (frame, rows))).collect()
    }

    /// The workers whose rows are in a picture.
    pub(crate) fn workers(&self, frame: FrameId) -> BTreeSet<WorkerId> {
        self.lock().open.get(&frame).map(Canvas::workers).unwrap_or_default()
    }

    /// Closes a frame and hands out its picture; `None` if it is not open or not complete.
    pub(crate) fn finish(self: &Arc<Self>, frame: FrameId) -> Option<FramePixels> {
        let canvas = self.lock().open.remove(&frame).filter(Canvas::is_complete)?;
        Some(FramePixels { bytes: canvas.pixels, home: Arc::downgrade(self) })
    }

    /// Closes a frame that was dropped.
    pub(crate) fn discard(&self, frame: FrameId) {
        let mut inner = self.lock();
        if let Some(canvas) = inner.open.remove(&frame) {
            inner.keep_spare(canvas.pixels);
        }
    }

    /// Takes the memory of a picture back for later frames.
    fn keep_spare(&self, pixels: Vec<u8>) {
        self.lock().keep_spare(pixels);
    }

    /// Sets a function that is called at the start of each decoding.
    #[cfg(test)]
    pub(crate) fn on_decode(&self, hook: impl Fn() + Send + Sync + 'static) {
        self.decoder.on_decode(hook);
    }

    /// Locks the pictures. A poisoned lock is used as it is: a panic leaves no picture inconsistent.
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inner {
    /// The picture for a worker's pixels; `None` if they are to be dropped.
    fn canvas(&mut self, from: WorkerId, frame: FrameId) -> Option<&mut Canvas> {
        if self.rejected.contains(&from) {
            return None;
        }
        self.open.get_mut(&frame)
    }

    fn keep_spare(&mut self, pixels: Vec<u8>) {
        // Later frames usually have the size of the newest one.
        let size = self.open.last_key_value().map_or(pixels.len(), |(_, canvas)| canvas.pixels.len());
        self.spare.retain(|spare| spare.len() == size);
        if pixels.len() == size && self.spare.len() < SPARE_BUFFERS {
            self.spare.push(pixels);
        }
    }
}

#[cfg(test)]
mod tests;
