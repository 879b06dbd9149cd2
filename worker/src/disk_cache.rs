//! What was fetched outlives the worker: assets in a folder, each under its hash, least recently used out.
//!
//! Several workers may share a folder. A file appears whole or not at all (written beside its place, then renamed), is
//! held against its name when it is read, and may be gone at any time. A cache that cannot do its work (a full disk, a
//! folder that cannot be written) says so once and leaves it: assets then come from the master.

use std::fs::{self, File, Metadata};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use rayfarm_protocol::AssetId;
use rayfarm_tracer::files::open_regular;

/// Files that are kept, however small they are.
const MAX_FILES: usize = 4096;

/// A file that was begun and not finished for so long belongs to a worker that has died.
const ABANDONED: Duration = Duration::from_secs(3600);

/// What an unfinished file's name ends in.
const UNFINISHED: &str = "part";

/// A folder of assets.
#[derive(Debug)]
pub(crate) struct DiskCache {
    folder: PathBuf,
    limit_bytes: u64,
    has_complained: AtomicBool,
}

/// A file of the cache.
struct Kept {
    path: PathBuf,
    bytes: u64,
    used: SystemTime,
    /// Somebody is writing it, and would miss it.
    is_unfinished: bool,
}

impl DiskCache {
    /// A cache in this folder, which is made when there is something to keep.
    pub(crate) fn new(folder: PathBuf, limit_bytes: u64) -> Self {
        Self { folder, limit_bytes, has_complained: AtomicBool::new(false) }
    }

    /// How long an asset is, if it is here.
    pub(crate) fn find(&self, id: AssetId) -> Option<u64> {
        // Not followed where it is a link, and not opened where it is something that opening could wait for.
        fs::symlink_metadata(self.path(id)).ok().filter(Metadata::is_file).map(|metadata| metadata.len())
    }

    /// An asset's bytes if there are `size` of them and they are what their name says, marked as just used. A file that
    /// is neither is removed, so that the asset is fetched again.
    pub(crate) fn read(&self, id: AssetId, size: u64) -> Option<Vec<u8>> {
        let path = self.path(id);
        let mut file = open_regular(&path).ok()?;
        match read_exactly(&mut file, size) {
            Ok(bytes) if AssetId::of(&bytes) == id => {
                // Whoever cannot say so loses it a little earlier.
                let _ = file.set_modified(SystemTime::now());
                Some(bytes)
            }
            outcome => {
                let why =
                    outcome.err().map_or("its bytes are not those of its name".to_owned(), |e| e.to_string());
                tracing::warn!("{}: {why}; it is fetched again", path.display());
                let _ = fs::remove_file(&path);
                None
            }
        }
    }

    /// Keeps an asset's bytes. What cannot be kept is told, once, and does no harm.
    pub(crate) fn write(&self, id: AssetId, bytes: &[u8]) {
        if let Err(error) = self.try_write(id, bytes)
            && !self.has_complained.swap(true, Ordering::Relaxed)
        {
            let folder = self.folder.display();
            tracing::warn!(
                "cannot keep assets in {folder}: {error}; they will be fetched again after a restart \
                 (--cache DIR names another folder, --no-cache does without)"
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
        // Of the process, not of this cache: others of this process may keep the same asset just now.
        static BEGUN: AtomicU64 = AtomicU64::new(0);
        let number = BEGUN.fetch_add(1, Ordering::Relaxed);
        let unfinished = self.folder.join(format!("{id}.{}-{number}.{UNFINISHED}", std::process::id()));
        let written = write_new(&unfinished, bytes).and_then(|()| fs::rename(&unfinished, self.path(id)));
        if written.is_err() {
            let _ = fs::remove_file(&unfinished);
        }
        written
    }

    /// Removes what was not used for longest until `bytes` more fit.
    fn make_room(&self, bytes: u64) {
        let mut kept = self.kept();
        kept.sort_by_key(|file| file.used);
        let mut count = kept.len();
        let mut used: u64 = kept.iter().map(|file| file.bytes).sum();
        for file in kept.into_iter().filter(|file| !file.is_unfinished) {
            if used.saturating_add(bytes) <= self.limit_bytes && count < MAX_FILES {
                return;
            }
            // Another worker may have been quicker: it is gone either way.
            let _ = fs::remove_file(&file.path);
            used -= file.bytes;
            count -= 1;
        }
    }

    /// The files that are the cache's own; others in the folder are left alone. Unfinished ones of the dead are removed.
    fn kept(&self) -> Vec<Kept> {
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let files = entries.filter_map(|entry| {
            let metadata = entry.metadata().ok().filter(Metadata::is_file)?;
            let (path, bytes, used) = (entry.path(), metadata.len(), metadata.modified().ok()?);
            let is_unfinished = match Name::of(&path) {
                Name::Asset => false,
                Name::Unfinished => true,
                Name::Foreign => return None,
            };
            if is_unfinished && used.elapsed().is_ok_and(|age| age > ABANDONED) {
                let _ = fs::remove_file(&path);
                return None;
            }
            Some(Kept { path, bytes, used, is_unfinished })
        });
        files.collect()
    }

    fn path(&self, id: AssetId) -> PathBuf {
        self.folder.join(id.to_string())
    }
}

/// What a file's name makes of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Name {
    Asset,
    Unfinished,
    Foreign,
}

impl Name {
    fn of(path: &Path) -> Self {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let (hash, rest) = name.split_once('.').unwrap_or((name, ""));
        let is_hash = hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
        match (is_hash, rest) {
            (true, "") => Self::Asset,
            (true, rest) if rest.ends_with(UNFINISHED) => Self::Unfinished,
            _ => Self::Foreign,
        }
    }
}

/// The folder for what can be fetched again, as the system has it: `$XDG_CACHE_HOME` or `~/.cache`, and their like.
pub(crate) fn user_folder() -> Option<PathBuf> {
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

/// For nobody else to read, as other programs do it with theirs.
fn make_folder(folder: &Path) -> io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(folder)
}

/// A file that must be new, so that no other file is written into, and that only its owner reads: scenes may be secret.
fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(path)?.write_all(bytes)
}

/// All bytes of a file that must have `size` of them; memory for no more is asked for.
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

    /// As if it had been used that long ago.
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
    fn what_is_written_is_found_again_by_another_cache() {
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
        // One that shrank between the two looks is no other case.
        assert_eq!(cache.read(id, 301), None);
    }

    #[test]
    fn the_least_recently_used_goes_and_the_limit_holds() {
        let (_folder, cache) = cache(LIMIT);
        let assets: Vec<_> = (0..3).map(|salt| asset(salt, 300)).collect();
        for (n, (id, bytes)) in assets.iter().enumerate() {
            cache.write(*id, bytes);
            age(&cache, *id, 100 - n as u64);
        }
        // The oldest is used, so the second goes.
        assert!(fetch(&cache, assets[0].0).is_some());
        let (id, bytes) = asset(9, 300);
        cache.write(id, &bytes);
        assert_eq!(
            assets.iter().map(|(id, _)| cache.find(*id).is_some()).collect::<Vec<_>>(),
            [true, false, true]
        );
        assert!(cache.find(id).is_some());
        // More than all of the limit is not kept, and displaces nothing.
        let (large, bytes) = asset(10, 1001);
        cache.write(large, &bytes);
        assert_eq!((cache.find(large), names(&cache).len()), (None, 3));
    }

    #[test]
    fn foreign_files_stay_and_unfinished_ones_of_the_dead_go() {
        let (_folder, cache) = cache(LIMIT);
        let (id, bytes) = asset(1, 900);
        cache.write(id, &bytes);
        let begun = |who: &str| cache.folder.join(format!("{id}.{who}.{UNFINISHED}"));
        for path in [begun("1-0"), begun("2-0"), cache.folder.join("letter.txt")] {
            fs::write(path, [0; 50]).unwrap();
        }
        let old = SystemTime::now() - 2 * ABANDONED;
        File::options().write(true).open(begun("1-0")).unwrap().set_modified(old).unwrap();
        let (other, bytes) = asset(2, 960);
        cache.write(other, &bytes);
        assert!(!begun("1-0").exists() && cache.folder.join("letter.txt").exists());
        assert_eq!((cache.find(id), cache.find(other)), (None, Some(960)));
    }

    #[test]
    fn a_folder_that_cannot_be_is_no_error() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let cache = DiskCache::new(file.path().join("below"), LIMIT);
        let (id, bytes) = asset(1, 10);
        cache.write(id, &bytes);
        assert_eq!((cache.find(id), cache.read(id, 10)), (None, None));
        assert!(cache.has_complained.load(Ordering::Relaxed));
    }

    #[test]
    fn many_writers_and_readers_at_once_never_see_a_torn_file() {
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
                            assert_eq!(size, 300, "a torn file");
                            assert!(own.read(*id, size).is_none_or(|read| read == *bytes));
                        }
                    }
                    assert!(!own.has_complained.load(Ordering::Relaxed));
                });
            }
        });
        assert!(names(&cache).iter().all(|name| !name.ends_with(UNFINISHED)), "{:?}", names(&cache));
    }
}
