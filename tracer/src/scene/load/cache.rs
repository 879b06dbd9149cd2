//! Results of reading files, kept from one load of a scene to the next as long as the files are unchanged.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::files::FileStamp;

/// Number of loads for which an unused result is kept, because a change of the scene may be undone.
const MAX_UNUSED_LOADS: u64 = 16;

/// Results by what was read and how. Clones are handles to the same results.
#[derive(Debug)]
pub(super) struct FileCache<K, V>(Arc<Mutex<Inner<K, V>>>);

#[derive(Debug)]
struct Inner<K, V> {
    results: BTreeMap<K, Cached<V>>,
    /// Number of the current load.
    load: u64,
    /// Files that the current load has read, or has tried to read.
    files: Vec<FileStamp>,
}

#[derive(Debug)]
struct Cached<V> {
    value: V,
    files: Vec<FileStamp>,
    /// Number of the last load that used it.
    used: u64,
}

impl<K, V> Clone for FileCache<K, V> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<K, V> Default for FileCache<K, V> {
    fn default() -> Self {
        Self(Arc::new(Mutex::new(Inner { results: BTreeMap::new(), load: 0, files: Vec::new() })))
    }
}

impl<K: Ord, V: Clone> FileCache<K, V> {
    /// Begins a load: drops results that have not been used for long.
    pub(super) fn begin_load(&self) {
        let mut inner = self.lock();
        inner.load += 1;
        inner.files.clear();
        let load = inner.load;
        inner.results.retain(|_, cached| load - cached.used <= MAX_UNUSED_LOADS);
    }

    /// The result for `key`, or that of `read`, which adds the state of each file before it reads it.
    ///
    /// # Errors
    /// Those of `read`. They are not kept.
    pub(super) fn get_or_read<E>(
        &self,
        key: K,
        read: impl FnOnce(&mut Vec<FileStamp>) -> Result<V, E>,
    ) -> Result<V, E> {
        if let Some(value) = self.unchanged(&key) {
            return Ok(value);
        }
        let mut files = Vec::new();
        let value = read(&mut files);
        let mut inner = self.lock();
        inner.files.extend(files.iter().cloned());
        let value = value?;
        let used = inner.load;
        inner.results.insert(key, Cached { value: value.clone(), files, used });
        Ok(value)
    }

    /// Adds a file that the current load depends on.
    pub(super) fn note(&self, file: FileStamp) {
        self.lock().files.push(file);
    }

    /// Files that the current load has read, or has tried to read, with their state before that.
    pub(super) fn files(&self) -> Vec<FileStamp> {
        self.lock().files.clone()
    }

    fn unchanged(&self, key: &K) -> Option<V> {
        let mut inner = self.lock();
        let load = inner.load;
        let cached = inner.results.get_mut(key)?;
        if cached.files.iter().any(FileStamp::has_changed) {
            inner.results.remove(key);
            return None;
        }
        cached.used = load;
        let (value, files) = (cached.value.clone(), cached.files.clone());
        inner.files.extend(files);
        Some(value)
    }

    fn lock(&self) -> MutexGuard<'_, Inner<K, V>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_is_read_again_when_a_file_of_it_changes_or_appears() {
        let folder = tempfile::tempdir().unwrap();
        let [model, library] = ["a.obj", "a.mtl"].map(|name| folder.path().join(name));
        std::fs::write(&model, "1").unwrap();
        let cache = FileCache::default();
        let mut reads = 0;
        let mut load = || {
            cache.begin_load();
            let value = cache.get_or_read("a", |files| {
                reads += 1;
                files.extend([&model, &library].map(|path| FileStamp::of(path)));
                std::fs::read_to_string(&model)
            });
            (value.unwrap(), cache.files().len(), reads)
        };
        assert_eq!(load(), ("1".into(), 2, 1));
        assert_eq!(load(), ("1".into(), 2, 1));
        std::fs::write(&model, "other").unwrap();
        assert_eq!(load(), ("other".into(), 2, 2));
        std::fs::write(&library, "").unwrap();
        assert_eq!(load(), ("other".into(), 2, 3));
        assert_eq!(load(), ("other".into(), 2, 3));
    }

    #[test]
    fn errors_are_not_kept_and_unused_results_not_for_ever() {
        let cache = FileCache::default();
        assert_eq!(cache.get_or_read(1, |_| Err("no")), Err("no"));
        assert_eq!(cache.get_or_read(1, |_| Ok::<_, &str>("yes")), Ok("yes"));
        for load in 0..=MAX_UNUSED_LOADS {
            cache.begin_load();
            let left = cache.lock().results.len();
            assert_eq!(left, usize::from(load < MAX_UNUSED_LOADS), "load {load}");
        }
    }
}
