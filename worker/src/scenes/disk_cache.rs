//! Cache of assets on the disk, for later runs: a folder with one file per asset, named by its hash, bounded in bytes, with
//! eviction of the least recently used.
//!
//! Several workers may share a folder. A file is written under a temporary name and renamed, so it appears complete or not
//! at all. It is checked against its name when it is read, and may be removed at any time. A cache that cannot write (a
//! full disk, a read-only folder) logs one warning; assets then come from the master.

use std::fs::{self, File, Metadata};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use rayfarm_protocol::AssetId;
use rayfarm_tracer::files::open_regular;

/// Most files in the folder, of any size.
const MAX_FILES: usize = 4096;

/// Age at which a temporary file is removed, because the worker that wrote it has ended.
const TEMPORARY_MAX_AGE: Duration = Duration::from_secs(3600);

/// Extension of temporary files.
const TEMPORARY_EXTENSION: &str = "part";

/// A cache of assets in a folder.
#[derive(Debug)]
pub(crate) struct DiskCache {
    folder: PathBuf,
    limit_bytes: u64,
    has_warned: AtomicBool,
}

/// A file of the cache.
struct CachedFile {
    path: PathBuf,
    bytes: u64,
    used: SystemTime,
    /// Whether the file is temporary: another worker may be writing it.
    is_temporary: bool,
}

impl DiskCache {
    /// Makes a cache in a folder, which is created at the first write.
    pub(crate) fn new(folder: PathBuf, limit_bytes: u64) -> Self {
        Self { folder, limit_bytes, has_warned: AtomicBool::new(false) }
    }

    /// Returns the size of an asset's file in bytes, if it is a regular file.
    pub(crate) fn find(&self, id: AssetId) -> Option<u64> {
        // No link is followed and no file is opened, because to open a pipe could block.
        fs::symlink_metadata(self.path(id)).ok().filter(Metadata::is_file).map(|metadata| metadata.len())
    }

    /// Reads an asset of `size` bytes, checks its hash, and marks it as used. A file of another size or hash is removed,
    /// so that the asset is fetched again.
    pub(crate) fn read(&self, id: AssetId, size: u64) -> Option<Vec<u8>> {
        let path = self.path(id);
        // A link is not followed, wherever it leads.
        self.find(id)?;
        let mut file = open_regular(&path).ok()?;
        match read_exactly(&mut file, size) {
            Ok(bytes) if AssetId::of(&bytes) == id => {
                // Where the time cannot be set, the file is evicted earlier.
                let _ = file.set_modified(SystemTime::now());
                Some(bytes)
            }
            outcome => {
                let why =
                    outcome.err().map_or("its bytes do not match its name".to_owned(), |e| e.to_string());
                tracing::warn!("{}: {why}; it is fetched again", path.display());
                let _ = fs::remove_file(&path);
                None
            }
        }
    }

    /// Writes an asset. The first failure is logged as a warning; no failure is an error.
    pub(crate) fn write(&self, id: AssetId, bytes: &[u8]) {
        if let Err(error) = self.try_write(id, bytes)
            && !self.has_warned.swap(true, Ordering::Relaxed)
        {
            let folder = self.folder.display();
            tracing::warn!(
                "cannot write assets to {folder}: {error}; they are fetched again after a restart \
                 (--cache DIR selects another folder, --no-cache none)"
            );
        }
    }

    fn try_write(&self, id: AssetId, bytes: &[u8]) -> io::Result<()> {
        let size = bytes.len() as u64;
        if size > self.limit_bytes || self.find(id) == Some(size) {
            return Ok(());
        }
        make_folder(&self.folder)?;
        self.make_room(size);
        // One counter per process, because other caches of the process may write the same asset at the same time.
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let temporary =
            self.folder.join(format!("{id}.{}-{number}.{TEMPORARY_EXTENSION}", std::process::id()));
        let written = write_new(&temporary, bytes).and_then(|()| fs::rename(&temporary, self.path(id)));
        if written.is_err() {
            let _ = fs::remove_file(&temporary);
        }
        written
    }

    /// Removes the least recently used files until `bytes` more fit.
    fn make_room(&self, bytes: u64) {
        let mut files = self.files();
        files.sort_by_key(|file| file.used);
        let mut count = files.len();
        let mut used: u64 = files.iter().map(|file| file.bytes).sum();
        for file in files.into_iter().filter(|file| !file.is_temporary) {
            if used.saturating_add(bytes) <= self.limit_bytes && count < MAX_FILES {
                return;
            }
            // Another worker may have removed the file already.
            let _ = fs::remove_file(&file.path);
            used -= file.bytes;
            count -= 1;
        }
    }

    /// Lists the files of the cache, and removes old temporary files. Other files in the folder are ignored.
    fn files(&self) -> Vec<CachedFile> {
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let files = entries.filter_map(|entry| {
            let metadata = entry.metadata().ok().filter(Metadata::is_file)?;
            let (path, bytes, used) = (entry.path(), metadata.len(), metadata.modified().ok()?);
            let is_temporary = match FileKind::of(&path) {
                FileKind::Asset => false,
                FileKind::Temporary => true,
                FileKind::Foreign => return None,
            };
            if is_temporary && used.elapsed().is_ok_and(|age| age > TEMPORARY_MAX_AGE) {
                let _ = fs::remove_file(&path);
                return None;
            }
            Some(CachedFile { path, bytes, used, is_temporary })
        });
        files.collect()
    }

    fn path(&self, id: AssetId) -> PathBuf {
        self.folder.join(id.to_string())
    }
}

/// Kind of a file, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FileKind {
    Asset,
    Temporary,
    Foreign,
}

impl FileKind {
    fn of(path: &Path) -> Self {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let (hash, rest) = name.split_once('.').unwrap_or((name, ""));
        let is_hash = hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
        match (is_hash, rest) {
            (true, "") => Self::Asset,
            (true, rest) if rest.ends_with(TEMPORARY_EXTENSION) => Self::Temporary,
            _ => Self::Foreign,
        }
    }
}

/// The user's cache folder by the system's convention: `$XDG_CACHE_HOME` or `~/.cache` on Linux.
pub(crate) fn user_cache_folder() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = if cfg!(windows) {
        variable("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        variable("HOME").map(|home| home.join("Library/Caches"))
    } else {
        variable("XDG_CACHE_HOME").or_else(|| variable("HOME").map(|home| home.join(".cache")))
    };
    base.map(|base| base.join("rayfarm"))
}

/// Creates the folder, readable for its owner only.
fn make_folder(folder: &Path) -> io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(folder)
}

/// Writes a new file, readable for its owner only, because scenes may be confidential. An existing file is an error.
fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(path)?.write_all(bytes)
}

/// Reads a file that must have at least `size` bytes. Allocates `size` bytes.
fn read_exactly(file: &mut File, size: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let capacity = usize::try_from(size).map_err(|_| io::ErrorKind::OutOfMemory)?;
    bytes.try_reserve_exact(capacity).map_err(|_| io::ErrorKind::OutOfMemory)?;
    file.take(size).read_to_end(&mut bytes)?;
    if bytes.len() == capacity { Ok(bytes) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: u64 = 1000;

    fn cache(limit_bytes: u64) -> (tempfile::TempDir, DiskCache) {
        let folder = tempfile::tempdir().unwrap();
        let cache = DiskCache::new(folder.path().join("deep/rayfarm"), limit_bytes);
        (folder, cache)
    }

    fn asset(salt: u8, len: usize) -> (AssetId, Vec<u8>) {
        let bytes = vec![salt; len];
        (AssetId::of(&bytes), bytes)
    }

    fn fetch(cache: &DiskCache, id: AssetId) -> Option<Vec<u8>> {
        cache.read(id, cache.find(id)?)
    }

    /// Sets the time of the last use to that many seconds ago.
    fn age(cache: &DiskCache, id: AssetId, seconds: u64) {
        let then = SystemTime::now() - Duration::from_secs(seconds);
        File::options().write(true).open(cache.path(id)).unwrap().set_modified(then).unwrap();
    }

    fn names(cache: &DiskCache) -> Vec<String> {
        let entries = fs::read_dir(&cache.folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_written_asset_is_found_by_another_cache() {
        let (_folder, cache) = cache(LIMIT);
        let (id, bytes) = asset(1, 300);
        assert_eq!(cache.find(id), None);
        cache.write(id, &bytes);
        let restarted = DiskCache::new(cache.folder.clone(), LIMIT);
        assert_eq!(restarted.find(id), Some(300));
        assert_eq!(fetch(&restarted, id), Some(bytes));
        assert_eq!(names(&cache), [id.to_string()]);
    }

    #[test]
    fn a_damaged_file_is_removed_and_can_be_written_again() {
        let (_folder, cache) = cache(LIMIT);
        let (id, bytes) = asset(1, 300);
        for damaged in [vec![2; 300], vec![1; 299], vec![1; 301], Vec::new()] {
            cache.write(id, &bytes);
            fs::write(cache.path(id), damaged).unwrap();
            assert_eq!(fetch(&cache, id), None);
            assert_eq!(cache.find(id), None);
        }
        cache.write(id, &bytes);
        // A file that shrinks between `find` and `read` is damaged as well.
        assert_eq!(cache.read(id, 301), None);
    }

    #[test]
    fn the_least_recently_used_is_evicted_within_the_limit() {
        let (_folder, cache) = cache(LIMIT);
        let assets: Vec<_> = (0..3).map(|salt| asset(salt, 300)).collect();
        for (n, (id, bytes)) in assets.iter().enumerate() {
            cache.write(*id, bytes);
            age(&cache, *id, 100 - n as u64);
        }
        // The first is used, so the second is evicted.
        assert!(fetch(&cache, assets[0].0).is_some());
        let (id, bytes) = asset(9, 300);
        cache.write(id, &bytes);
        assert_eq!(
            assets.iter().map(|(id, _)| cache.find(*id).is_some()).collect::<Vec<_>>(),
            [true, false, true]
        );
        assert!(cache.find(id).is_some());
        // An asset above the limit is not written and evicts nothing.
        let (large, bytes) = asset(10, 1001);
        cache.write(large, &bytes);
        assert_eq!((cache.find(large), names(&cache).len()), (None, 3));
    }

    #[test]
    fn other_files_stay_and_old_temporary_files_are_removed() {
        let (_folder, cache) = cache(LIMIT);
        let (id, bytes) = asset(1, 900);
        cache.write(id, &bytes);
        let temporary = |writer: &str| cache.folder.join(format!("{id}.{writer}.{TEMPORARY_EXTENSION}"));
        for path in [temporary("1-0"), temporary("2-0"), cache.folder.join("letter.txt")] {
            fs::write(path, [0; 50]).unwrap();
        }
        let old = SystemTime::now() - 2 * TEMPORARY_MAX_AGE;
        File::options().write(true).open(temporary("1-0")).unwrap().set_modified(old).unwrap();
        let (other, bytes) = asset(2, 960);
        cache.write(other, &bytes);
        assert!(!temporary("1-0").exists() && cache.folder.join("letter.txt").exists());
        assert_eq!((cache.find(id), cache.find(other)), (None, Some(960)));
    }

    #[cfg(unix)]
    #[test]
    fn links_are_not_followed_and_files_are_private() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let (folder, cache) = cache(LIMIT);
        let (id, bytes) = asset(1, 300);
        cache.write(id, &bytes);
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!((mode(&cache.folder), mode(&cache.path(id))), (0o700, 0o600));

        let outside = folder.path().join("outside");
        fs::rename(cache.path(id), &outside).unwrap();
        symlink(&outside, cache.path(id)).unwrap();
        assert_eq!((cache.find(id), cache.read(id, 300)), (None, None));
        // A write replaces the link, and leaves the file that it refers to.
        let before = fs::metadata(&outside).unwrap().modified().unwrap();
        cache.write(id, &bytes);
        assert_eq!(cache.read(id, 300), Some(bytes));
        assert_eq!(fs::metadata(&outside).unwrap().modified().unwrap(), before);
    }

    #[test]
    fn an_impossible_folder_is_no_error() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let cache = DiskCache::new(file.path().join("below"), LIMIT);
        let (id, bytes) = asset(1, 10);
        cache.write(id, &bytes);
        assert_eq!((cache.find(id), cache.read(id, 10)), (None, None));
        assert!(cache.has_warned.load(Ordering::Relaxed));
    }

    #[test]
    fn concurrent_writers_and_readers_see_complete_files_only() {
        let (_folder, cache) = cache(LIMIT);
        let assets: Vec<_> = (0..5).map(|salt| asset(salt, 300)).collect();
        std::thread::scope(|scope| {
            for first in 0..4 {
                let own = DiskCache::new(cache.folder.clone(), LIMIT);
                let assets = &assets;
                scope.spawn(move || {
                    for (id, bytes) in assets.iter().cycle().skip(first).take(200) {
                        own.write(*id, bytes);
                        if let Some(size) = own.find(*id) {
                            assert_eq!(size, 300, "an incomplete file");
                            assert!(own.read(*id, size).is_none_or(|read| read == *bytes));
                        }
                    }
                    assert!(!own.has_warned.load(Ordering::Relaxed));
                });
            }
        });
        assert!(names(&cache).iter().all(|name| !name.ends_with(TEMPORARY_EXTENSION)), "{:?}", names(&cache));
    }
}
