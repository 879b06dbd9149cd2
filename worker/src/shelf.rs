//! What a worker passes on: assets that its master has given it or is giving it, to whoever shows the master's token.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use rayfarm_protocol::AssetId;
use rayfarm_protocol::limits::{MAX_PEER_CACHE_BYTES, PEER_CACHE_TIME};
use rayfarm_protocol::peer::{Fetch, ShareKey, token};
use tokio::sync::Notify;
use tokio::sync::futures::Notified;

use crate::growing::Growing;

/// Assets by name, for as long as somebody may ask for them.
#[derive(Debug, Default)]
pub(crate) struct Shelf {
    inner: Mutex<Inner>,
    /// Something was put there.
    filled: Notify,
}

/// What is behind a token.
#[derive(Clone, Debug)]
pub(crate) enum Opened {
    /// This asset, or what is there of it.
    Here(Arc<Growing>),
    /// An asset that the master has been asked for: others may come for it sooner than its first byte.
    Expected,
    /// Nothing.
    Closed,
}

#[derive(Debug, Default)]
struct Inner {
    /// Of the present session with the master.
    key: Option<ShareKey>,
    expected: BTreeSet<AssetId>,
    assets: BTreeMap<AssetId, Shelved>,
}

#[derive(Debug)]
struct Shelved {
    bytes: Arc<Growing>,
    /// When it was last seen incomplete, or asked for.
    wanted_at: Instant,
}

impl Shelf {
    /// A new session: nothing of the one before is passed on any more.
    pub(crate) fn clear(&self) {
        *self.lock() = Inner::default();
    }

    /// What the master's tokens are made of.
    pub(crate) fn set_key(&self, key: ShareKey) {
        self.lock().key = Some(key);
    }

    /// The master is asked for an asset.
    pub(crate) fn expect(&self, id: AssetId) {
        self.lock().expected.insert(id);
    }

    /// An asset comes in.
    pub(crate) fn put(&self, id: AssetId, bytes: Arc<Growing>) {
        let mut inner = self.lock();
        inner.expected.remove(&id);
        inner.assets.insert(id, Shelved { bytes, wanted_at: Instant::now() });
        drop(inner);
        self.filled.notify_waiters();
    }

    /// Waits until something is put there. Made before a look, it misses nothing that comes after it.
    pub(crate) fn filled(&self) -> Notified<'_> {
        self.filled.notified()
    }

    /// What somebody asks for, if the token opens it.
    pub(crate) fn open(&self, fetch: &Fetch) -> Opened {
        let mut inner = self.lock();
        if inner.key.is_none_or(|key| token(&key, fetch.id) != fetch.token) {
            return Opened::Closed;
        }
        let is_expected = inner.expected.contains(&fetch.id);
        match inner.assets.get_mut(&fetch.id) {
            Some(shelved) => {
                shelved.wanted_at = Instant::now();
                Opened::Here(Arc::clone(&shelved.bytes))
            }
            None if is_expected => Opened::Expected,
            None => Opened::Closed,
        }
    }

    /// Forgets what nobody has asked for lately, and the longest unasked of what is too much. Whoever reads it goes on.
    pub(crate) fn tidy(&self, now: Instant) {
        let mut inner = self.lock();
        inner.assets.retain(|_, shelved| {
            if !shelved.bytes.is_whole() {
                // Those that were abandoned are held by nobody else.
                shelved.wanted_at = now;
                return Arc::strong_count(&shelved.bytes) > 1;
            }
            now.saturating_duration_since(shelved.wanted_at) < PEER_CACHE_TIME
        });
        while inner.bytes() > MAX_PEER_CACHE_BYTES {
            let whole = inner.assets.iter().filter(|(_, shelved)| shelved.bytes.is_whole());
            let Some(oldest) = whole.min_by_key(|(_, s)| s.wanted_at).map(|(id, _)| *id) else { return };
            inner.assets.remove(&oldest);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inner {
    /// What is kept for others alone: an asset that still comes in is in memory anyway.
    fn bytes(&self) -> usize {
        let whole = self.assets.values().filter(|shelved| shelved.bytes.is_whole());
        whole.map(|shelved| shelved.bytes.size()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: ShareKey = ShareKey([3; 32]);

    fn whole(byte: u8, size: usize) -> (AssetId, Arc<Growing>) {
        let growing = Growing::new(size).unwrap();
        growing.push(&vec![byte; size]);
        growing.finish().unwrap();
        (AssetId([byte; 32]), growing)
    }

    fn opens(shelf: &Shelf, key: &ShareKey, id: AssetId) -> bool {
        matches!(shelf.open(&Fetch { id, token: token(key, id), offset: 0 }), Opened::Here(_))
    }

    #[test]
    fn only_the_masters_token_opens_and_only_its_own_asset() {
        let shelf = Shelf::default();
        let ((a, bytes), (b, others)) = (whole(1, 5), whole(2, 5));
        shelf.put(a, bytes);
        shelf.put(b, others);
        assert!(!opens(&shelf, &KEY, a), "no key, no token");
        shelf.set_key(KEY);
        assert!(opens(&shelf, &KEY, a) && opens(&shelf, &KEY, b));
        assert!(!opens(&shelf, &ShareKey([4; 32]), a));
        let wrong = Fetch { id: a, token: token(&KEY, b), offset: 0 };
        assert!(matches!(shelf.open(&wrong), Opened::Closed));
        let c = AssetId([9; 32]);
        let fetch = Fetch { id: c, token: token(&KEY, c), offset: 0 };
        assert!(matches!(shelf.open(&fetch), Opened::Closed));
        shelf.expect(c);
        assert!(matches!(shelf.open(&fetch), Opened::Expected));
        assert!(matches!(shelf.open(&Fetch { token: wrong.token, ..fetch }), Opened::Closed));
        shelf.clear();
        assert!(!opens(&shelf, &KEY, a));
    }

    #[test]
    fn what_nobody_asks_for_goes_and_what_comes_in_stays() {
        let shelf = Shelf::default();
        shelf.set_key(KEY);
        let (a, bytes) = whole(1, 5);
        shelf.put(a, bytes);
        let coming = Growing::new(5).unwrap();
        shelf.put(AssetId([2; 32]), Arc::clone(&coming));
        let now = Instant::now();
        shelf.tidy(now + PEER_CACHE_TIME / 2);
        assert!(opens(&shelf, &KEY, a));
        shelf.tidy(now + PEER_CACHE_TIME * 2);
        assert!(!opens(&shelf, &KEY, a) && opens(&shelf, &KEY, AssetId([2; 32])));
        coming.abandon();
        drop(coming);
        shelf.tidy(now);
        assert!(!opens(&shelf, &KEY, AssetId([2; 32])));
    }
}
