//! Reuse of pixel buffers. Fresh memory would have to be cleared, and is in no CPU cache.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use bytes::{Bytes, BytesMut};

/// Most buffers tracked. The session's queue and the bands in progress hold no more at a time.
const MAX_TRACKED: usize = 16;

/// Buffers that were sent as pixels and can be reused when they are dropped.
#[derive(Debug, Default)]
pub(super) struct BufferPool {
    tracked: Mutex<VecDeque<Bytes>>,
}

impl BufferPool {
    /// Returns a buffer of `length` bytes with unspecified content.
    pub(super) fn acquire(&self, length: usize) -> BytesMut {
        let mut buffer = self.free(length).unwrap_or_default();
        buffer.resize(length, 0);
        buffer
    }

    /// Tracks a buffer, so that it is reused after all other references to it are dropped.
    pub(super) fn track(&self, bytes: &Bytes) {
        let mut tracked = self.tracked();
        if tracked.len() == MAX_TRACKED {
            tracked.pop_front();
        }
        tracked.push_back(bytes.clone());
    }

    /// Returns the oldest free buffer, if it has enough capacity. A free buffer that is too small is dropped.
    fn free(&self, length: usize) -> Option<BytesMut> {
        let mut tracked = self.tracked();
        let index = tracked.iter().position(Bytes::is_unique)?;
        let buffer = tracked.remove(index)?.try_into_mut().ok()?;
        (buffer.capacity() >= length).then_some(buffer)
    }

    /// Locks the list. A poisoned lock is usable, because every statement leaves the list consistent.
    fn tracked(&self) -> MutexGuard<'_, VecDeque<Bytes>> {
        self.tracked.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_buffer_is_reused_after_its_last_reference_is_dropped() {
        let buffers = BufferPool::default();
        let first = buffers.acquire(3000).freeze();
        let place = first.as_ptr();
        buffers.track(&first);
        assert_ne!(buffers.acquire(3000).as_ptr(), place, "the buffer is still referenced");
        drop(first);
        let shorter = buffers.acquire(2000);
        assert_eq!((shorter.as_ptr(), shorter.len()), (place, 2000));
    }

    #[test]
    fn a_buffer_that_is_too_small_is_dropped() {
        let buffers = BufferPool::default();
        let small = buffers.acquire(10).freeze();
        buffers.track(&small);
        drop(small);
        assert_eq!(buffers.acquire(1000).len(), 1000);
        assert!(buffers.tracked().is_empty());
    }

    #[test]
    fn the_number_of_tracked_buffers_is_bounded() {
        let buffers = BufferPool::default();
        let held: Vec<_> = (0..MAX_TRACKED + 5).map(|_| buffers.acquire(8).freeze()).collect();
        held.iter().for_each(|bytes| buffers.track(bytes));
        assert_eq!(buffers.tracked().len(), MAX_TRACKED);
    }
}
