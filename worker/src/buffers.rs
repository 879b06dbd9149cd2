//! Memory of segments that are under way, used again: fresh memory would have to be cleared, and is in no cache.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use bytes::{Bytes, BytesMut};

/// Segments remembered; the session's queue and the bands under way hold no more at a time.
const MAX_LENT: usize = 16;

/// Buffers that were handed out and may be free by now.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    lent: Mutex<VecDeque<Bytes>>,
}

impl Buffers {
    /// `length` bytes of any content.
    pub(crate) fn take(&self, length: usize) -> BytesMut {
        let mut buffer = self.free(length).unwrap_or_default();
        buffer.resize(length, 0);
        buffer
    }

    /// Remembers memory that can be taken again when nobody else holds these bytes any more.
    pub(crate) fn lend(&self, bytes: &Bytes) {
        let mut lent = self.lent();
        if lent.len() == MAX_LENT {
            lent.pop_front();
        }
        lent.push_back(bytes.clone());
    }

    /// The memory that was handed out first and is free, if it is large enough without moving.
    fn free(&self, length: usize) -> Option<BytesMut> {
        let mut lent = self.lent();
        let index = lent.iter().position(Bytes::is_unique)?;
        let buffer = lent.remove(index)?.try_into_mut().ok()?;
        (buffer.capacity() >= length).then_some(buffer)
    }

    /// What it holds is whole after every statement: a poisoned lock is usable.
    fn lent(&self) -> MutexGuard<'_, VecDeque<Bytes>> {
        self.lent.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_comes_back_when_nobody_holds_it() {
        let buffers = Buffers::default();
        let first = buffers.take(3000).freeze();
        let place = first.as_ptr();
        buffers.lend(&first);
        assert_ne!(buffers.take(3000).as_ptr(), place, "somebody holds it");
        drop(first);
        let shorter = buffers.take(2000);
        assert_eq!((shorter.as_ptr(), shorter.len()), (place, 2000));
    }

    #[test]
    fn too_small_memory_is_let_go() {
        let buffers = Buffers::default();
        let small = buffers.take(10).freeze();
        buffers.lend(&small);
        drop(small);
        assert_eq!(buffers.take(1000).len(), 1000);
        assert!(buffers.lent().is_empty());
    }

    #[test]
    fn what_is_remembered_is_bounded() {
        let buffers = Buffers::default();
        let held: Vec<_> = (0..MAX_LENT + 5).map(|_| buffers.take(8).freeze()).collect();
        held.iter().for_each(|bytes| buffers.lend(bytes));
        assert_eq!(buffers.lent().len(), MAX_LENT);
    }
}
