//! Assets that a worker serves to other workers.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use rayfarm_protocol::limits::{MAX_PEER_CACHE_BYTES, PEER_CACHE_TIME};
use rayfarm_protocol::peer::{PeerRequest, ShareKey};
use rayfarm_protocol::{AssetId, KeyHash};
use tokio::sync::Notify;
use tokio::sync::futures::Notified;

use super::share_keys::ShareKeys;
use super::{PartialAsset, StallClock};

/// Assets of one session with the master, partial or complete, by id. The master's tokens give access to them.
#[derive(Debug, Default)]
pub(crate) struct PeerCache {
    inner: Mutex<Inner>,
    /// Notified when an asset is inserted.
    inserted: Notify,
    /// Chunks that arrive at this worker.
    stall_clock: Arc<StallClock>,
}

/// Result of looking up the asset of a request.
#[derive(Clone, Debug)]
pub(super) enum Lookup {
    /// The asset, partial or complete.
    Found(Arc<PartialAsset>),
    /// An asset that was requested from the master: a peer's request may arrive before the asset's first byte.
    Expected,
    /// The asset is unknown, or the token is wrong.
    Denied,
}

#[derive(Debug, Default)]
struct Inner {
    /// Keys of the current session's tokens.
    keys: ShareKeys,
    expected: BTreeSet<AssetId>,
    assets: BTreeMap<AssetId, Entry>,
}

#[derive(Debug)]
struct Entry {
    asset: Arc<PartialAsset>,
    /// Time when the asset was last seen incomplete, or last requested.
    used_at: Instant,
}

impl PeerCache {
    /// Removes everything at the beginning of a session.
    pub(crate) fn reset(&self) {
        *self.lock() = Inner::default();
    }

    /// The clock of the transfers to this worker.
    pub(crate) fn stall_clock(&self) -> &Arc<StallClock> {
        &self.stall_clock
    }

    /// Sets the next key of the session's tokens. Tokens of the key before the previous one are invalid then.
    pub(crate) fn set_key(&self, generation: u64, key: ShareKey) {
        if let Err(why) = self.lock().keys.set(generation, key) {
            tracing::warn!("the master's key for tokens of assets is ignored: {why}");
        }
    }

    /// Records that an asset was requested from the master.
    pub(crate) fn expect(&self, id: AssetId) {
        self.lock().expected.insert(id);
    }

    /// Inserts an asset whose transfer begins.
    pub(crate) fn insert(&self, id: AssetId, asset: Arc<PartialAsset>) {
        let mut inner = self.lock();
        inner.expected.remove(&id);
        inner.assets.insert(id, Entry { asset, used_at: Instant::now() });
        drop(inner);
        self.inserted.notify_waiters();
    }

    /// Waits for the next insertion. Called before a [`lookup`](Self::lookup), it misses no insertion after it.
    pub(super) fn inserted(&self) -> Notified<'_> {
        self.inserted.notified()
    }

    /// Looks up the asset of a request and checks the token. `client`: hash of the requesting worker's public key.
    pub(super) fn lookup(&self, request: &PeerRequest, client: Option<KeyHash>) -> Lookup {
        let mut inner = self.lock();
        if !inner.keys.allow(request, client) {
            return Lookup::Denied;
        }
        let is_expected = inner.expected.contains(&request.id);
        match inner.assets.get_mut(&request.id) {
            Some(entry) => {
                entry.used_at = Instant::now();
                Lookup::Found(Arc::clone(&entry.asset))
            }
            None if is_expected => Lookup::Expected,
            None => Lookup::Denied,
        }
    }

    /// Evicts assets without a request for [`PEER_CACHE_TIME`], and the least recently requested ones beyond
    /// [`MAX_PEER_CACHE_BYTES`]. Transfers of evicted assets continue.
    pub(crate) fn evict(&self, now: Instant) {
        let mut inner = self.lock();
        inner.assets.retain(|_, entry| {
            if !entry.asset.is_complete() {
                // An abandoned asset has no other owner.
                entry.used_at = now;
                return Arc::strong_count(&entry.asset) > 1;
            }
            now.saturating_duration_since(entry.used_at) < PEER_CACHE_TIME
        });
        while inner.complete_bytes() > MAX_PEER_CACHE_BYTES {
            let complete = inner.assets.iter().filter(|(_, entry)| entry.asset.is_complete());
            let oldest = complete.min_by_key(|(_, entry)| entry.used_at).map(|(id, _)| *id);
            let Some(oldest) = oldest else { return };
            inner.assets.remove(&oldest);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inner {
    /// Number of bytes of complete assets. Partial assets do not count: their transfers need the memory anyway.
    fn complete_bytes(&self) -> usize {
        let complete = self.assets.values().filter(|entry| entry.asset.is_complete());
        complete.map(|entry| entry.asset.size()).sum()
    }
}

#[cfg(test)]
mod tests {
    use rayfarm_protocol::peer::Token;

    use super::*;

    const KEY: ShareKey = ShareKey([3; 32]);

    fn complete(byte: u8, size: usize) -> (AssetId, Arc<PartialAsset>) {
        let asset = PartialAsset::new(size).unwrap();
        asset.append(&vec![byte; size]);
        asset.finish().unwrap();
        (AssetId([byte; 32]), asset)
    }

    fn request(key: &ShareKey, id: AssetId) -> PeerRequest {
        PeerRequest { id, token: Token::new(key, id, None, 0), offset: 0 }
    }

    fn is_found(cache: &PeerCache, key: &ShareKey, id: AssetId) -> bool {
        matches!(cache.lookup(&request(key, id), None), Lookup::Found(_))
    }

    #[test]
    fn a_token_gives_access_to_its_own_asset_only() {
        let cache = PeerCache::default();
        let ((a, bytes), (b, others)) = (complete(1, 5), complete(2, 5));
        cache.insert(a, bytes);
        cache.insert(b, others);
        assert!(!is_found(&cache, &KEY, a), "there is no key yet");
        cache.set_key(0, KEY);
        assert!(is_found(&cache, &KEY, a) && is_found(&cache, &KEY, b));
        assert!(!is_found(&cache, &ShareKey([4; 32]), a));
        let wrong = PeerRequest { token: Token::new(&KEY, b, None, 0), ..request(&KEY, a) };
        assert!(matches!(cache.lookup(&wrong, None), Lookup::Denied));
        let expected = request(&KEY, AssetId([9; 32]));
        assert!(matches!(cache.lookup(&expected, None), Lookup::Denied));
        cache.expect(expected.id);
        assert!(matches!(cache.lookup(&expected, None), Lookup::Expected));
        let wrong = PeerRequest { token: wrong.token, ..expected };
        assert!(matches!(cache.lookup(&wrong, None), Lookup::Denied));
        cache.reset();
        assert!(!is_found(&cache, &KEY, a));
    }

    #[test]
    fn unused_and_abandoned_assets_are_evicted_and_partial_ones_are_kept() {
        let cache = PeerCache::default();
        cache.set_key(0, KEY);
        let (a, bytes) = complete(1, 5);
        cache.insert(a, bytes);
        let partial = PartialAsset::new(5).unwrap();
        cache.insert(AssetId([2; 32]), Arc::clone(&partial));
        let now = Instant::now();
        cache.evict(now + PEER_CACHE_TIME / 2);
        assert!(is_found(&cache, &KEY, a));
        cache.evict(now + PEER_CACHE_TIME * 2);
        assert!(!is_found(&cache, &KEY, a) && is_found(&cache, &KEY, AssetId([2; 32])));
        partial.abandon();
        drop(partial);
        cache.evict(now);
        assert!(!is_found(&cache, &KEY, AssetId([2; 32])));
    }
}
