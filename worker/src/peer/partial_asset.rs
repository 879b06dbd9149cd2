//! The bytes of an asset while it arrives, readable from the front.

use std::sync::{Arc, PoisonError, RwLock};

use bytes::Bytes;
use tokio::sync::watch;

/// A buffer of known size that fills from front to back. One writer appends; any number of readers read concurrently.
#[derive(Debug)]
pub(crate) struct PartialAsset {
    size: usize,
    state: RwLock<State>,
    progress: watch::Sender<Progress>,
}

#[derive(Debug)]
enum State {
    Partial(Vec<u8>),
    /// All bytes have arrived and match the asset's hash.
    Complete(Bytes),
    /// The transfer failed, or the bytes do not match the hash.
    Abandoned,
}

/// Progress of a partial asset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Progress {
    /// Number of bytes that have arrived.
    pub(super) len: usize,
    /// Whether the asset is abandoned, so that no byte of it is readable.
    pub(super) abandoned: bool,
}

impl PartialAsset {
    /// Allocates `size` bytes. Returns `None` where the allocation fails.
    pub(crate) fn new(size: usize) -> Option<Arc<Self>> {
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(size).ok()?;
        let progress = watch::Sender::new(Progress { len: 0, abandoned: false });
        Some(Arc::new(Self { size, state: RwLock::new(State::Partial(bytes)), progress }))
    }

    /// Number of bytes of the whole asset.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Number of bytes that have arrived.
    pub(crate) fn len(&self) -> usize {
        self.progress.borrow().len
    }

    /// Appends bytes. The caller ensures that the total does not exceed [`size`](Self::size).
    pub(crate) fn append(&self, part: &[u8]) {
        let mut state = self.state.write().unwrap_or_else(PoisonError::into_inner);
        let State::Partial(bytes) = &mut *state else { return };
        bytes.extend_from_slice(part);
        let len = bytes.len();
        drop(state);
        self.progress.send_modify(|progress| progress.len = len);
    }

    /// Marks the asset as complete and returns its bytes, shared and not copied. Returns `None` where it is abandoned.
    pub(crate) fn finish(&self) -> Option<Bytes> {
        let mut state = self.state.write().unwrap_or_else(PoisonError::into_inner);
        if let State::Partial(bytes) = &mut *state {
            *state = State::Complete(Bytes::from(std::mem::take(bytes)));
        }
        match &*state {
            State::Complete(bytes) => Some(bytes.clone()),
            State::Partial(_) | State::Abandoned => None,
        }
    }

    /// Makes all bytes unreadable, unless the asset is complete.
    pub(crate) fn abandon(&self) {
        let mut state = self.state.write().unwrap_or_else(PoisonError::into_inner);
        if matches!(*state, State::Partial(_)) {
            *state = State::Abandoned;
            drop(state);
            self.progress.send_modify(|progress| progress.abandoned = true);
        }
    }

    /// Whether all bytes have arrived and match the asset's hash.
    pub(super) fn is_complete(&self) -> bool {
        matches!(*self.state.read().unwrap_or_else(PoisonError::into_inner), State::Complete(_))
    }

    /// Reads up to `most` bytes from `offset` on, and none where none have arrived.
    pub(super) fn read(&self, offset: usize, most: usize) -> Bytes {
        match &*self.state.read().unwrap_or_else(PoisonError::into_inner) {
            State::Partial(bytes) => {
                let end = bytes.len().min(offset.saturating_add(most));
                bytes.get(offset..end).map(Bytes::copy_from_slice).unwrap_or_default()
            }
            State::Complete(bytes) => {
                let end = bytes.len().min(offset.saturating_add(most));
                if offset < end { bytes.slice(offset..end) } else { Bytes::new() }
            }
            State::Abandoned => Bytes::new(),
        }
    }

    /// Subscribes to changes of the progress.
    pub(super) fn subscribe(&self) -> watch::Receiver<Progress> {
        self.progress.subscribe()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_readable_as_soon_as_they_arrive() {
        let asset = PartialAsset::new(6).unwrap();
        assert_eq!((asset.read(0, 9).len(), asset.size()), (0, 6));
        asset.append(b"abc");
        assert_eq!((&asset.read(1, 9)[..], &asset.read(0, 2)[..]), (&b"bc"[..], &b"ab"[..]));
        assert!(asset.read(3, 9).is_empty() && asset.read(99, 9).is_empty() && !asset.is_complete());
        asset.append(b"def");
        let complete = asset.finish().unwrap();
        assert_eq!((&complete[..], &asset.read(4, 1)[..]), (&b"abcdef"[..], &b"e"[..]));
        assert_eq!(asset.read(0, 6).as_ptr(), complete.as_ptr());
        asset.abandon();
        assert!(asset.is_complete() && asset.read(6, 1).is_empty());
    }

    #[test]
    fn an_abandoned_asset_is_not_readable() {
        let asset = PartialAsset::new(6).unwrap();
        let progress = asset.subscribe();
        asset.append(b"abc");
        asset.abandon();
        assert!(asset.read(0, 3).is_empty() && asset.finish().is_none());
        assert_eq!(*progress.borrow(), Progress { len: 3, abandoned: true });
        assert!(PartialAsset::new(usize::MAX).is_none());
    }
}
