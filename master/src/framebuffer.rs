//! Where pixels end up: one picture per frame in flight, filled by sessions in whatever order segments arrive.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Deref;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use rayfarm_protocol::pixels::{BlockError, unpack};
use rayfarm_protocol::{Encoding, FrameId, Lease};

/// Buffers kept for the next frame: two in flight and one on the screen.
const SPARE_BUFFERS: usize = 3;

/// The pictures in flight. A frame that is not open takes no pixels: that is how those of a superseded frame are
/// kept out.
#[derive(Debug, Default)]
pub(crate) struct Framebuffers {
    inner: Mutex<Inner>,
}

#[derive(Debug, Default)]
struct Inner {
    open: BTreeMap<FrameId, Canvas>,
    spare: Vec<Vec<u8>>,
}

#[derive(Debug)]
struct Canvas {
    row_bytes: usize,
    pixels: Vec<u8>,
    /// For each row, whether its pixels are here.
    filled: Vec<bool>,
    missing: usize,
}

/// What became of a segment's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Written {
    /// They are in the picture, or had been there before. To decode and copy them took that long.
    Kept { decode: Duration },
    /// The frame is not open any more.
    Superseded,
}

/// Pixels that do not fit their lease.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Misfit {
    #[error("{lease} takes {expected} bytes of pixels, {got} arrived")]
    Bytes { lease: Lease, expected: usize, got: usize },
    #[error("{lease}: {source}")]
    Blocks { lease: Lease, source: BlockError },
    #[error("{lease} lies outside of the picture of {rows} rows")]
    Rows { lease: Lease, rows: usize },
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
        inner.open.insert(frame, Canvas { row_bytes, pixels, filled: vec![false; rows], missing: rows });
    }

    /// Puts the pixels of a lease into the picture. Rows that are there already stay as they are.
    ///
    /// # Errors
    /// The pixels do not fit the lease, or the lease does not fit the picture; no row counts as written.
    pub(crate) fn write(&self, lease: Lease, encoding: Encoding, bytes: &[u8]) -> Result<Written, Misfit> {
        let mut inner = self.lock();
        let Some(canvas) = inner.open.get_mut(&lease.frame) else { return Ok(Written::Superseded) };
        let begun = Instant::now();
        canvas.write(lease, encoding, bytes)?;
        Ok(Written::Kept { decode: begun.elapsed() })
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
        // A picture of another size than the newest will not come back.
        let size = self.open.last_key_value().map_or(pixels.len(), |(_, canvas)| canvas.pixels.len());
        self.spare.retain(|spare| spare.len() == size);
        if pixels.len() == size && self.spare.len() < SPARE_BUFFERS {
            self.spare.push(pixels);
        }
    }
}

impl Canvas {
    fn write(&mut self, lease: Lease, encoding: Encoding, bytes: &[u8]) -> Result<(), Misfit> {
        let (first, count) = (lease.first_row as usize, lease.row_count as usize);
        let (row_bytes, rows) = (self.row_bytes, self.filled.len());
        let outside = Misfit::Rows { lease, rows };
        let filled = self.filled.get_mut(first..first.saturating_add(count)).ok_or(outside)?;
        let target = self.pixels.get_mut(first * row_bytes..(first + count) * row_bytes).ok_or(outside)?;
        if filled.contains(&true) {
            // Somebody was quicker with some of them. What is there stays, whatever these bytes are worth.
            let mut aside = vec![0; target.len()];
            decode(lease, encoding, bytes, &mut aside)?;
            let rows = target.chunks_exact_mut(row_bytes.max(1)).zip(aside.chunks_exact(row_bytes.max(1)));
            let missing = rows.zip(&*filled).filter(|(_, filled)| !**filled);
            missing.for_each(|((target, row), _)| target.copy_from_slice(row));
        } else {
            decode(lease, encoding, bytes, target)?;
        }
        self.missing -= filled.iter().filter(|filled| !**filled).count();
        filled.fill(true);
        Ok(())
    }
}

/// The pixels of a lease, all of them or none that count.
fn decode(lease: Lease, encoding: Encoding, bytes: &[u8], target: &mut [u8]) -> Result<(), Misfit> {
    let (expected, got) = (target.len(), bytes.len());
    match encoding {
        Encoding::Raw if expected == got => target.copy_from_slice(bytes),
        Encoding::Raw => return Err(Misfit::Bytes { lease, expected, got }),
        Encoding::Lz4 => unpack(bytes, target).map_err(|source| Misfit::Blocks { lease, source })?,
    }
    Ok(())
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
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;
    use rayfarm_protocol::pixels::Packer;

    use super::*;

    const FRAME: FrameId = FrameId(3);

    fn lease(first_row: u32, row_count: u32) -> Lease {
        Lease { frame: FRAME, segment: 0, attempt: 0, first_row, row_count }
    }

    fn opened(width: u32, height: u32) -> Arc<Framebuffers> {
        let framebuffers = Arc::new(Framebuffers::default());
        framebuffers.open(FRAME, width, height);
        framebuffers
    }

    /// Whether the pixels were kept.
    fn write(framebuffers: &Framebuffers, lease: Lease, bytes: &[u8]) -> Result<bool, Misfit> {
        let written = framebuffers.write(lease, Encoding::Raw, bytes)?;
        Ok(matches!(written, Written::Kept { .. }))
    }

    fn packed(bytes: &[u8], block_bytes: usize) -> Vec<u8> {
        let mut packer = Packer::new();
        bytes.chunks(block_bytes).flat_map(|part| packer.block(part).unwrap()).collect()
    }

    #[test]
    fn segments_in_any_order_make_the_picture() {
        let framebuffers = opened(1, 3);
        assert_eq!(write(&framebuffers, lease(2, 1), &[7, 8, 9]), Ok(true));
        assert_eq!(write(&framebuffers, lease(0, 2), &[1, 2, 3, 4, 5, 6]), Ok(true));
        assert_eq!(framebuffers.finish(FRAME).unwrap().into_vec(), [1, 2, 3, 4, 5, 6, 7, 8, 9]);
    }

    #[test]
    fn an_incomplete_picture_is_not_handed_out() {
        let framebuffers = opened(1, 2);
        write(&framebuffers, lease(0, 1), &[1; 3]).unwrap();
        write(&framebuffers, lease(0, 1), &[1; 3]).unwrap();
        assert!(framebuffers.finish(FRAME).is_none());
    }

    #[test]
    fn the_first_pixels_of_a_row_stay() {
        let framebuffers = opened(1, 2);
        write(&framebuffers, lease(1, 1), &[1; 3]).unwrap();
        write(&framebuffers, lease(0, 2), &[2; 6]).unwrap();
        assert_eq!(*framebuffers.finish(FRAME).unwrap(), [2, 2, 2, 1, 1, 1]);
    }

    #[test]
    fn what_does_not_fit_is_refused_and_writes_nothing() {
        let framebuffers = opened(1, 2);
        let short = write(&framebuffers, lease(0, 2), &[9; 5]).unwrap_err();
        assert_eq!(short, Misfit::Bytes { lease: lease(0, 2), expected: 6, got: 5 });
        for outside in [lease(1, 2), lease(2, 1), lease(u32::MAX, u32::MAX)] {
            assert_eq!(write(&framebuffers, outside, &[9; 6]), Err(Misfit::Rows { lease: outside, rows: 2 }));
        }
        write(&framebuffers, lease(0, 2), &[1; 6]).unwrap();
        assert_eq!(*framebuffers.finish(FRAME).unwrap(), [1; 6]);
    }

    #[test]
    fn a_closed_frame_takes_no_pixels() {
        let framebuffers = opened(1, 1);
        framebuffers.discard(FRAME);
        assert_eq!(write(&framebuffers, lease(0, 1), &[1; 3]), Ok(false));
        assert!(framebuffers.finish(FRAME).is_none());
    }

    #[test]
    fn buffers_are_used_again_and_not_hoarded() {
        let framebuffers = opened(1, 1);
        let pictures: Vec<FramePixels> = (0..6)
            .map(|n| {
                framebuffers.open(FrameId(n), 1, 1);
                write(&framebuffers, Lease { frame: FrameId(n), ..lease(0, 1) }, &[n as u8; 3]).unwrap();
                framebuffers.finish(FrameId(n)).unwrap()
            })
            .collect();
        let first = pictures[0].as_ptr();
        drop(pictures);
        assert_eq!(framebuffers.lock().spare.len(), SPARE_BUFFERS);
        assert!(framebuffers.lock().spare.iter().any(|spare| spare.as_ptr() == first));
        framebuffers.open(FRAME, 2, 2);
        framebuffers.discard(FRAME);
        assert!(framebuffers.lock().spare.iter().all(|spare| spare.len() == 12));
    }

    #[test]
    fn packed_pixels_are_unpacked_into_their_rows() {
        let framebuffers = opened(2, 4);
        let rows: Vec<u8> = (0..18).collect();
        framebuffers.write(lease(1, 3), Encoding::Lz4, &packed(&rows, 7)).unwrap();
        write(&framebuffers, lease(0, 2), &[9; 12]).unwrap();
        assert_eq!(*framebuffers.finish(FRAME).unwrap(), [vec![9; 6], rows].concat());
    }

    #[test]
    fn packed_pixels_leave_the_rows_alone_that_are_there() {
        let framebuffers = opened(1, 3);
        write(&framebuffers, lease(1, 1), &[1; 3]).unwrap();
        framebuffers.write(lease(0, 3), Encoding::Lz4, &packed(&[2; 9], 9)).unwrap();
        assert_eq!(*framebuffers.finish(FRAME).unwrap(), [2, 2, 2, 1, 1, 1, 2, 2, 2]);
    }

    proptest! {
        #[test]
        fn broken_blocks_fill_no_row_and_spoil_none(
            bytes in vec(any::<u8>(), 0..80),
            at in any::<prop::sample::Index>(),
            valid: bool,
        ) {
            let framebuffers = opened(4, 4);
            write(&framebuffers, lease(2, 1), &[3; 12]).unwrap();
            let mut broken = if valid { packed(&[5; 48], 20) } else { bytes };
            if valid {
                broken.truncate(at.index(broken.len()));
            }
            let refused = framebuffers.write(lease(0, 4), Encoding::Lz4, &broken).is_err();
            prop_assert!(refused || !valid);
            if refused {
                write(&framebuffers, lease(0, 4), &[5; 48]).unwrap();
                let expected = [vec![5; 24], vec![3; 12], vec![5; 12]].concat();
                prop_assert_eq!(&*framebuffers.finish(FRAME).unwrap(), &expected[..]);
            }
        }
    }
}
