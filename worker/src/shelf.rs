//! What a worker passes on: assets that its master has given it or is giving it, to whoever shows the master's token.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use rayfarm_protocol::AssetId;
use rayfarm_protocol::limits::{MAX_SHELF_BYTES, SHELF_TIME};
use rayfarm_protocol::passing::{Fetch, ShareKey, token};

use crate::growing::Growing;

/// Assets by name, for as long as somebody may ask for them.
#[derive(Debug, Default)]
pub(crate) struct Shelf(Mutex<Inner>);

#[derive(Debug, Default)]
struct Inner {
    /// Of the present session with the master.
    key: Option<ShareKey>,
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

    /// An asset comes in.
    pub(crate) fn put(&self, id: AssetId, bytes: Arc<Growing>) {
        self.lock().assets.insert(id, Shelved { bytes, wanted_at: Instant::now() });
    }

    /// What somebody asks for, if the token opens it.
    pub(crate) fn open(&self, fetch: &Fetch) -> Option<Arc<Growing>> {
        let mut inner = self.lock();
        let key = inner.key?;
        let shelved = inner.assets.get_mut(&fetch.id).filter(|_| token(&key, fetch.id) == fetch.token)?;
        shelved.wanted_at = Instant::now();
        Some(Arc::clone(&shelved.bytes))
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
            now.saturating_duration_since(shelved.wanted_at) < SHELF_TIME
        });
        while inner.bytes() > MAX_SHELF_BYTES {
            let whole = inner.assets.iter().filter(|(_, shelved)| shelved.bytes.is_whole());
            let Some(oldest) = whole.min_by_key(|(_, s)| s.wanted_at).map(|(id, _)| *id) else { return };
            inner.assets.remove(&oldest);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
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
        shelf.open(&Fetch { id, token: token(key, id), offset: 0 }).is_some()
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
        assert!(shelf.open(&Fetch { id: a, token: token(&KEY, b), offset: 0 }).is_none());
        assert!(!opens(&shelf, &KEY, AssetId([9; 32])));
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
        shelf.tidy(now + SHELF_TIME / 2);
        assert!(opens(&shelf, &KEY, a));
        shelf.tidy(now + SHELF_TIME * 2);
        assert!(!opens(&shelf, &KEY, a) && opens(&shelf, &KEY, AssetId([2; 32])));
        coming.abandon();
        drop(coming);
        shelf.tidy(now);
        assert!(!opens(&shelf, &KEY, AssetId([2; 32])));
    }
}
