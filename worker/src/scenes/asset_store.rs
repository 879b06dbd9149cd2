//! Cache of decoded assets in memory, bounded in bytes, with eviction of the least recently used.

use std::collections::{BTreeMap, BTreeSet};

use rayfarm_protocol::AssetId;

/// Values by the hash of the bytes that they were decoded from. A value counts with the size of those bytes.
#[derive(Debug)]
pub(super) struct AssetStore<V> {
    limit_bytes: u64,
    used_bytes: u64,
    clock: u64,
    entries: BTreeMap<AssetId, Entry<V>>,
}

#[derive(Debug)]
struct Entry<V> {
    value: V,
    bytes: u64,
    used_at: u64,
}

impl<V> AssetStore<V> {
    /// Makes an empty store of at most `limit_bytes`.
    pub(super) fn new(limit_bytes: u64) -> Self {
        Self { limit_bytes, used_bytes: 0, clock: 0, entries: BTreeMap::new() }
    }

    /// Largest total size, in bytes.
    pub(super) fn limit_bytes(&self) -> u64 {
        self.limit_bytes
    }

    #[cfg(test)]
    pub(super) fn used_bytes(&self) -> u64 {
        self.used_bytes
    }

    /// Looks up a value and marks it as used.
    pub(super) fn get(&mut self, id: AssetId) -> Option<&V> {
        self.clock += 1;
        let entry = self.entries.get_mut(&id)?;
        entry.used_at = self.clock;
        Some(&entry.value)
    }

    /// Looks up a value without marking it as used.
    pub(super) fn peek(&self, id: AssetId) -> Option<&V> {
        self.entries.get(&id).map(|entry| &entry.value)
    }

    #[cfg(test)]
    pub(super) fn contains(&self, id: AssetId) -> bool {
        self.entries.contains_key(&id)
    }

    /// Evicts the least recently used values, except those in `keep`, until `bytes` and `reserved_bytes` more fit.
    /// Returns `false` where they do not fit; all values outside `keep` are evicted then.
    pub(super) fn make_room(&mut self, bytes: u64, reserved_bytes: u64, keep: &BTreeSet<AssetId>) -> bool {
        let needed = bytes.saturating_add(reserved_bytes);
        while self.used_bytes.saturating_add(needed) > self.limit_bytes {
            let evictable = self.entries.iter().filter(|(id, _)| !keep.contains(id));
            let Some(oldest) = evictable.min_by_key(|(_, entry)| entry.used_at).map(|(id, _)| *id) else {
                return false;
            };
            if let Some(entry) = self.entries.remove(&oldest) {
                self.used_bytes -= entry.bytes;
                tracing::debug!("evicted asset {oldest} ({} bytes) from memory", entry.bytes);
            }
        }
        true
    }

    /// Evicts the least recently used of the values that `is_meant` selects, except those in `keep`, until at most `most` of
    /// the others are left.
    pub(super) fn keep_most_recent(
        &mut self,
        most: usize,
        is_meant: impl Fn(&V) -> bool,
        keep: &BTreeSet<AssetId>,
    ) {
        let meant = self.entries.iter().filter(|(id, entry)| !keep.contains(id) && is_meant(&entry.value));
        let mut by_use: Vec<(u64, AssetId)> = meant.map(|(id, entry)| (entry.used_at, *id)).collect();
        by_use.sort_unstable();
        let too_many = by_use.len().saturating_sub(most);
        for (_, id) in by_use.into_iter().take(too_many) {
            self.used_bytes -= self.entries.remove(&id).map_or(0, |entry| entry.bytes);
        }
    }

    /// Inserts a value of `bytes`. The caller has made room for it.
    pub(super) fn insert(&mut self, id: AssetId, value: V, bytes: u64) {
        self.clock += 1;
        self.used_bytes += bytes;
        if let Some(old) = self.entries.insert(id, Entry { value, bytes, used_at: self.clock }) {
            self.used_bytes -= old.bytes;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn id(number: u8) -> AssetId {
        AssetId([number; 32])
    }

    fn full_store() -> AssetStore<&'static str> {
        let mut store = AssetStore::new(100);
        for (number, name) in [(1, "a"), (2, "b"), (3, "c")] {
            assert!(store.make_room(30, 0, &BTreeSet::new()));
            store.insert(id(number), name, 30);
        }
        store
    }

    #[test]
    fn the_least_recently_used_is_evicted_first() {
        let mut store = full_store();
        store.get(id(1));
        assert!(store.make_room(30, 0, &BTreeSet::new()));
        assert!(store.contains(id(1)) && !store.contains(id(2)) && store.contains(id(3)));
        assert_eq!(store.used_bytes(), 60);
    }

    #[test]
    fn values_in_use_are_not_evicted() {
        let mut store = full_store();
        let keep = BTreeSet::from([id(1), id(2)]);
        assert!(store.make_room(40, 0, &keep));
        assert!(!store.contains(id(3)));
        assert!(!store.make_room(41, 0, &keep));
        assert!(store.contains(id(1)) && store.contains(id(2)));
    }

    #[test]
    fn only_the_most_recent_of_a_kind_are_kept() {
        let mut store = full_store();
        store.get(id(1));
        store.keep_most_recent(1, |name| *name != "c", &BTreeSet::new());
        assert!(store.contains(id(1)) && !store.contains(id(2)) && store.contains(id(3)));
        assert_eq!(store.used_bytes(), 60);
        store.keep_most_recent(0, |_| true, &BTreeSet::from([id(3)]));
        assert!(!store.contains(id(1)) && store.contains(id(3)));
    }

    #[test]
    fn reserved_bytes_count() {
        let mut store = full_store();
        assert!(store.make_room(10, 0, &BTreeSet::new()));
        assert_eq!(store.used_bytes(), 90);
        assert!(store.make_room(10, 60, &BTreeSet::new()));
        assert_eq!(store.used_bytes(), 30);
        assert!(!store.make_room(u64::MAX, 60, &BTreeSet::new()));
        assert_eq!(store.used_bytes(), 0);
    }

    #[test]
    fn a_replaced_value_counts_once() {
        let mut store = full_store();
        store.insert(id(3), "d", 10);
        assert_eq!((store.used_bytes(), store.get(id(3))), (70, Some(&"d")));
    }
}
