//! Where pixels end up: one picture per frame in flight, filled by sessions in whatever order segments arrive.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;
use std::ops::{Deref, Range};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use rayfarm_protocol::{Encoding, FrameId, Lease};

use rayfarm_scheduler::WorkerId;

use crate::verification::SegmentDigest;
use decode::Decoder;

pub(crate) use decode::Misfit;

mod decode;

/// Buffers kept for the next frame: two in flight and one on the screen.
const SPARE_BUFFERS: usize = 3;
/// Rejected workers that are remembered: what they had sent by then is dealt with long before there are so many more.
const MAX_REJECTED: usize = 1024;

/// The pictures in flight. A frame that is not open takes no pixels: that is how those of a superseded frame are
/// kept out.
#[derive(Debug, Default)]
pub(crate) struct Framebuffers {
    inner: Mutex<Inner>,
}

#[derive(Debug, Default)]
struct Inner {
    open: BTreeMap<FrameId, Canvas>,
    /// Workers whose pixels are not taken any more.
    rejected: VecDeque<WorkerId>,
    spare: Vec<Vec<u8>>,
    decoder: Decoder,
}

#[derive(Debug)]
struct Canvas {
    row_bytes: usize,
    pixels: Vec<u8>,
    /// For each row, whose pixels are here, if any are.
    filled: Vec<Option<WorkerId>>,
    missing: usize,
}

/// What became of a segment's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Written {
    /// They are in the picture, or had been there before. To decode and copy them took that long.
    Kept { decode: Duration },
    /// The frame is not open any more, or its worker was rejected.
    Superseded,
}

impl Framebuffers {
    /// Opens a frame of `width * height` pixels. Spare buffers are used again as they are: every row is written
    /// before anybody sees it.
    pub(crate) fn open(&self, frame: FrameId, width: u32, height: u32) {
        let (row_bytes, rows) = (width as usize * 3, height as usize);
        let mut inner = self.lock();
        let mut pixels = inner.spare.pop().unwrap_or_default();
        if pixels.len() != row_bytes * rows {
            // The operating system hands out zeroed pages as they are touched; resizing would write them all.
            pixels = vec![0; row_bytes * rows];
        }
        inner.open.insert(frame, Canvas { row_bytes, pixels, filled: vec![None; rows], missing: rows });
    }

    /// Puts the pixels of a lease into the picture. Rows that are there already stay as they are.
    ///
    /// # Errors
    /// The pixels do not fit the lease, or the lease does not fit the picture; no row counts as written.
    pub(crate) fn write(
        &self,
        from: WorkerId,
        lease: Lease,
        encoding: Encoding,
        bytes: &[u8],
    ) -> Result<Written, Misfit> {
        let Inner { open, rejected, decoder, .. } = &mut *self.lock();
        if rejected.contains(&from) {
            return Ok(Written::Superseded);
        }
        let Some(canvas) = open.get_mut(&lease.frame) else { return Ok(Written::Superseded) };
        let begun = Instant::now();
        canvas.write(from, lease, |target| decoder.decode(lease, encoding, bytes, target))?;
        Ok(Written::Kept { decode: begun.elapsed() })
    }

    /// A hash of the pixels of a lease, if all of them are here and this worker's.
    pub(crate) fn digest(&self, of: WorkerId, lease: Lease) -> Option<SegmentDigest> {
        let inner = self.lock();
        let canvas = inner.open.get(&lease.frame)?;
        let (first, end) = (lease.first_row as usize, lease.first_row as usize + lease.row_count as usize);
        let is_all_its = canvas.filled.get(first..end)?.iter().all(|filled| *filled == Some(of));
        let pixels = canvas.pixels.get(first * canvas.row_bytes..end * canvas.row_bytes)?;
        is_all_its.then(|| SegmentDigest::of(pixels))
    }

    /// Takes a worker's rows out of all pictures, and takes none of it any more. Returns which rows are missing now.
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

    /// Whose rows are in a picture.
    pub(crate) fn workers(&self, frame: FrameId) -> BTreeSet<WorkerId> {
        let inner = self.lock();
        let filled = inner.open.get(&frame).into_iter().flat_map(|canvas| &canvas.filled);
        filled.flatten().copied().collect()
    }

    /// Closes a frame and hands out its picture; `None` if it is not open or not complete.
    pub(crate) fn finish(self: &Arc<Self>, frame: FrameId) -> Option<FramePixels> {
        let mut inner = self.lock();
        let complete = inner.open.get(&frame).is_some_and(|canvas| canvas.missing == 0);
        let canvas = inner.open.remove(&frame).filter(|_| complete)?;
        Some(FramePixels { bytes: canvas.pixels, home: Arc::downgrade(self) })
    }

    /// Closes a frame that nobody wants any more.
    pub(crate) fn discard(&self, frame: FrameId) {
        let mut inner = self.lock();
        if let Some(canvas) = inner.open.remove(&frame) {
            inner.keep_spare(canvas.pixels);
        }
    }

    /// No panic leaves a picture half described, so a poisoned lock is as good as any.
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inner {
    fn keep_spare(&mut self, pixels: Vec<u8>) {
        // A picture of another size than the newest is seldom wanted again.
        let size = self.open.last_key_value().map_or(pixels.len(), |(_, canvas)| canvas.pixels.len());
        self.spare.retain(|spare| spare.len() == size);
        if pixels.len() == size && self.spare.len() < SPARE_BUFFERS {
            self.spare.push(pixels);
        }
    }
}

impl Canvas {
    /// `decode` fills the bytes of the lease's rows, all of them or none that count.
    fn write(
        &mut self,
        from: WorkerId,
        lease: Lease,
        decode: impl FnOnce(&mut [u8]) -> Result<(), Misfit>,
    ) -> Result<(), Misfit> {
        let (first, count) = (lease.first_row as usize, lease.row_count as usize);
        let (row_bytes, rows) = (self.row_bytes, self.filled.len());
        let outside = Misfit::Rows { lease, rows };
        let filled = self.filled.get_mut(first..first.saturating_add(count)).ok_or(outside)?;
        let target = self.pixels.get_mut(first * row_bytes..(first + count) * row_bytes).ok_or(outside)?;
        if filled.iter().any(Option::is_some) {
            // Somebody was quicker with some of them. What is there stays, whatever these bytes are worth.
            let mut aside = vec![0; target.len()];
            decode(&mut aside)?;
            let rows = target.chunks_exact_mut(row_bytes.max(1)).zip(aside.chunks_exact(row_bytes.max(1)));
            let missing = rows.zip(&*filled).filter(|(_, filled)| filled.is_none());
            missing.for_each(|((target, row), _)| target.copy_from_slice(row));
        } else {
            decode(target)?;
        }
        for filled in filled.iter_mut().filter(|filled| filled.is_none()) {
            *filled = Some(from);
            self.missing -= 1;
        }
        Ok(())
    }

    /// Empties a worker's rows; which they are, as runs.
    fn reject(&mut self, worker: WorkerId) -> impl Iterator<Item = Range<u32>> + use<> {
        let mut runs: Vec<Range<u32>> = Vec::new();
        let its = self.filled.iter_mut().zip(0..).filter(|(filled, _)| **filled == Some(worker));
        for (filled, row) in its {
            *filled = None;
            self.missing += 1;
            match runs.last_mut().filter(|run| run.end == row) {
                Some(run) => run.end = row + 1,
                None => runs.push(row..row + 1),
            }
        }
        runs.into_iter()
    }
}

/// A hash of pixels that go into no picture, of rows of `row_bytes` bytes.
///
/// # Errors
/// They do not fit the lease.
pub(crate) fn digest(
    lease: Lease,
    row_bytes: usize,
    encoding: Encoding,
    bytes: &[u8],
) -> Result<SegmentDigest, Misfit> {
    let mut pixels = vec![0; row_bytes * lease.row_count as usize];
    Decoder::default().decode(lease, encoding, bytes, &mut pixels)?;
    Ok(SegmentDigest::of(&pixels))
}

/// The pixels of a finished frame; read them as `&[u8]`. Dropped, their memory serves a later frame.
pub struct FramePixels {
    bytes: Vec<u8>,
    home: Weak<Framebuffers>,
}

impl FramePixels {
    /// Takes the bytes out, for those who keep the picture.
    pub fn into_vec(mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
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
            home.lock().keep_spare(std::mem::take(&mut self.bytes));
        }
    }
}

#[cfg(test)]
mod tests;
