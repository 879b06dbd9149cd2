//! Bytes of an asset while they come in, readable from the front by those to whom they are passed on.

use std::sync::{Arc, PoisonError, RwLock};

use bytes::Bytes;
use tokio::sync::watch;

/// One buffer of a known size that fills from front to back.
#[derive(Debug)]
pub(crate) struct Growing {
    size: usize,
    state: RwLock<State>,
    progress: watch::Sender<Progress>,
}

#[derive(Debug)]
enum State {
    Filling(Vec<u8>),
    /// All of it, and it bears the right name.
    Whole(Bytes),
    /// It will not be complete, or its bytes are worth nothing.
    Abandoned,
}

/// How far it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Progress {
    /// Bytes that are here.
    pub(crate) len: usize,
    /// Whether no more will come: nothing is left to read.
    pub(crate) abandoned: bool,
}

impl Growing {
    /// Room for `size` bytes, or `None` where this machine has no such memory.
    pub(crate) fn new(size: usize) -> Option<Arc<Self>> {
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(size).ok()?;
        let progress = watch::Sender::new(Progress { len: 0, abandoned: false });
        Some(Arc::new(Self { size, state: RwLock::new(State::Filling(bytes)), progress }))
    }

    /// All bytes that there will be.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Bytes that are here.
    pub(crate) fn len(&self) -> usize {
        self.progress.borrow().len
    }

    /// Adds bytes; the caller has seen to it that there is room.
    pub(crate) fn push(&self, part: &[u8]) {
        let mut state = self.state.write().unwrap_or_else(PoisonError::into_inner);
        let State::Filling(bytes) = &mut *state else { return };
        bytes.extend_from_slice(part);
        let len = bytes.len();
        drop(state);
        self.progress.send_modify(|progress| progress.len = len);
    }

    /// Takes all bytes to be whole. Shared, not copied; `None` where they have been abandoned.
    pub(crate) fn finish(&self) -> Option<Bytes> {
        let mut state = self.state.write().unwrap_or_else(PoisonError::into_inner);
        if let State::Filling(bytes) = &mut *state {
            *state = State::Whole(Bytes::from(std::mem::take(bytes)));
        }
        match &*state {
            State::Whole(bytes) => Some(bytes.clone()),
            State::Filling(_) | State::Abandoned => None,
        }
    }

    /// Nobody is to read any of it any more.
    pub(crate) fn abandon(&self) {
        let mut state = self.state.write().unwrap_or_else(PoisonError::into_inner);
        if matches!(*state, State::Filling(_)) {
            *state = State::Abandoned;
            drop(state);
            self.progress.send_modify(|progress| progress.abandoned = true);
        }
    }

    /// Whether all of it is here and right.
    pub(crate) fn is_whole(&self) -> bool {
        matches!(*self.state.read().unwrap_or_else(PoisonError::into_inner), State::Whole(_))
    }

    /// Up to `most` bytes from `offset` on; none where none are there yet.
    pub(crate) fn part(&self, offset: usize, most: usize) -> Bytes {
        match &*self.state.read().unwrap_or_else(PoisonError::into_inner) {
            State::Filling(bytes) => {
                let end = bytes.len().min(offset.saturating_add(most));
                bytes.get(offset..end).map(Bytes::copy_from_slice).unwrap_or_default()
            }
            State::Whole(bytes) => {
                let end = bytes.len().min(offset.saturating_add(most));
                if offset < end { bytes.slice(offset..end) } else { Bytes::new() }
            }
            State::Abandoned => Bytes::new(),
        }
    }

    /// Tells of every change.
    pub(crate) fn watch(&self) -> watch::Receiver<Progress> {
        self.progress.subscribe()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_there_as_soon_as_they_come() {
        let growing = Growing::new(6).unwrap();
        assert_eq!((growing.part(0, 9).len(), growing.size()), (0, 6));
        growing.push(b"abc");
        assert_eq!((&growing.part(1, 9)[..], &growing.part(0, 2)[..]), (&b"bc"[..], &b"ab"[..]));
        assert!(growing.part(3, 9).is_empty() && growing.part(99, 9).is_empty() && !growing.is_whole());
        growing.push(b"def");
        let whole = growing.finish().unwrap();
        assert_eq!((&whole[..], &growing.part(4, 1)[..]), (&b"abcdef"[..], &b"e"[..]));
        assert_eq!(growing.part(0, 6).as_ptr(), whole.as_ptr());
        growing.abandon();
        assert!(growing.is_whole() && growing.part(6, 1).is_empty());
    }

    #[test]
    fn nothing_is_read_of_what_was_abandoned() {
        let growing = Growing::new(6).unwrap();
        let watch = growing.watch();
        growing.push(b"abc");
        growing.abandon();
        assert!(growing.part(0, 3).is_empty() && growing.finish().is_none());
        assert_eq!(*watch.borrow(), Progress { len: 3, abandoned: true });
        assert!(Growing::new(usize::MAX).is_none());
    }
}
