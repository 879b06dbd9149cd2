//! The workers that have joined a master through TLS, and those whose keys are revoked: a file for each of them in the
//! master's state folder, with the hash of the key as its name. Several processes can change them without a lock.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use rayfarm_protocol::transport::{JoinedWorker, KeyHash, read_private, write_private};
use rayfarm_text::printable_within;

/// Most workers that are remembered. Beyond that, the one that joined the longest time ago is forgotten.
const MAX_WORKERS: usize = 1024;
/// Most revoked keys.
const MAX_REVOKED: usize = 4096;
/// Longest name of a worker in lists, in bytes.
const MAX_NAME_BYTES: usize = 64;
/// A worker that joins again within this time changes no file.
const REWRITE_AFTER: Duration = Duration::from_secs(60);
/// Least number of first digits that select a key.
const MIN_DIGITS: usize = 8;

/// A worker that has joined.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct KnownWorker {
    /// Hash of its public key.
    pub(super) key: KeyHash,
    /// The name that it sent last: printable, without line breaks.
    pub(super) name: String,
    /// Seconds since 1970 when it joined for the first time.
    pub(super) first: u64,
    /// Seconds since 1970 when it joined for the last time.
    pub(super) last: u64,
}

/// The files about workers in a state folder.
#[derive(Clone, Debug)]
pub(super) struct WorkerFiles {
    joined: PathBuf,
    revoked: PathBuf,
}

impl WorkerFiles {
    /// The files of this state folder.
    pub(super) fn of(state: &Path) -> Self {
        Self { joined: state.join("workers"), revoked: state.join("revoked") }
    }

    /// Records that a worker has joined at a time.
    ///
    /// # Errors
    /// A file that cannot be read or written.
    pub(super) fn add(&self, worker: &JoinedWorker, now: SystemTime) -> io::Result<()> {
        let name = printable_within(&worker.name, MAX_NAME_BYTES).into_owned();
        let last = seconds(now);
        let known = self.known(worker.key)?;
        if let Some(known) = &known
            && known.name == name
            && last.abs_diff(known.last) < REWRITE_AFTER.as_secs()
        {
            return Ok(());
        }
        let first = known.as_ref().map_or(last, |known| known.first);
        if known.is_none() {
            self.make_room()?;
        }
        write_private(&self.joined.join(worker.key.to_string()), &format!("{name}\n{first}\n{last}\n"))
    }

    /// The workers that have joined, the most recent first.
    ///
    /// # Errors
    /// A folder or file that cannot be read.
    pub(super) fn joined(&self) -> io::Result<Vec<KnownWorker>> {
        let keys = keys_in(&self.joined)?;
        let known: io::Result<Vec<_>> = keys.into_iter().map(|key| self.known(key)).collect();
        let mut known: Vec<KnownWorker> = known?.into_iter().flatten().collect();
        known.sort_by_key(|worker| std::cmp::Reverse((worker.last, worker.first)));
        Ok(known)
    }

    /// The revoked keys.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub(super) fn revoked(&self) -> io::Result<BTreeSet<KeyHash>> {
        keys_in(&self.revoked)
    }

    /// Revokes a key.
    ///
    /// # Errors
    /// A file that cannot be written, or too many revoked keys.
    pub(super) fn revoke(&self, key: KeyHash) -> io::Result<()> {
        if self.revoked()?.len() >= MAX_REVOKED {
            return Err(io::Error::other(format!(
                "{MAX_REVOKED} keys are revoked; `rayfarm-master trust rotate --key` refuses all workers"
            )));
        }
        write_private(&self.revoked.join(key.to_string()), "")
    }

    /// Admits a revoked key again. Returns whether it was revoked.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub(super) fn allow(&self, key: KeyHash) -> io::Result<bool> {
        match fs::remove_file(self.revoked.join(key.to_string())) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// The key that a text names: a name of one worker, at least eight first digits of a known key, or a whole key.
    ///
    /// # Errors
    /// A text that names no worker or several, or files that cannot be read.
    pub(super) fn find(&self, text: &str) -> Result<KeyHash, String> {
        if let Ok(key) = text.parse() {
            return Ok(key);
        }
        let joined = self.joined().map_err(|error| format!("the known workers cannot be read: {error}"))?;
        let revoked = self.revoked().map_err(|error| format!("the revoked keys cannot be read: {error}"))?;
        let is_prefix = |key: &KeyHash| {
            text.len() >= MIN_DIGITS && key.to_string().starts_with(&text.to_ascii_lowercase())
        };
        let named = joined.iter().filter(|worker| worker.name == text).map(|worker| worker.key);
        let known = joined.iter().map(|worker| worker.key).chain(revoked);
        let found: BTreeSet<KeyHash> = named.chain(known.filter(is_prefix)).collect();
        match found.len() {
            1 => found.first().copied().ok_or_else(String::new),
            0 => Err(format!(
                "no worker is named {text:?}; expected a name, at least {MIN_DIGITS} digits of a key, or a whole key; \
                 `rayfarm-master trust workers` lists them"
            )),
            count => {
                let keys: Vec<String> = found.iter().map(ToString::to_string).collect();
                Err(format!("{count} workers are named {text:?}; name one by its key: {}", keys.join(", ")))
            }
        }
    }

    fn known(&self, key: KeyHash) -> io::Result<Option<KnownWorker>> {
        let path = self.joined.join(key.to_string());
        let damaged = || {
            let text = format!("{} is damaged; delete it", path.display());
            io::Error::new(io::ErrorKind::InvalidData, text)
        };
        let Some(text) = read_private(&path)? else { return Ok(None) };
        let mut lines = text.lines();
        let name = lines.next().ok_or_else(damaged)?;
        let mut time = || lines.next().and_then(|line| line.parse().ok()).ok_or_else(damaged);
        let (first, last) = (time()?, time()?);
        Ok(Some(KnownWorker { key, name: printable_within(name, MAX_NAME_BYTES).into_owned(), first, last }))
    }

    /// Forgets the worker that joined the longest time ago, if there are too many.
    fn make_room(&self) -> io::Result<()> {
        if keys_in(&self.joined)?.len() < MAX_WORKERS {
            return Ok(());
        }
        match self.joined()?.last() {
            Some(oldest) => fs::remove_file(self.joined.join(oldest.key.to_string())),
            None => Ok(()),
        }
    }
}

/// The keys that the files of a folder are named by. Other files are ignored, and there is no folder at first.
fn keys_in(folder: &Path) -> io::Result<BTreeSet<KeyHash>> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(BTreeSet::new()),
        Err(error) => return Err(error),
    };
    let names = entries.map(|entry| entry.map(|entry| entry.file_name()));
    let keys = names.map(|name| name.map(|name| name.to_str().and_then(|name| name.parse().ok())));
    keys.filter_map(Result::transpose).collect()
}

fn seconds(time: SystemTime) -> u64 {
    time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worker(byte: u8, name: &str) -> JoinedWorker {
        JoinedWorker { key: KeyHash([byte; 32]), name: name.to_owned() }
    }

    fn at(minutes: u64) -> SystemTime {
        SystemTime::UNIX_EPOCH + Duration::from_secs(60 * minutes)
    }

    fn files() -> (tempfile::TempDir, WorkerFiles) {
        let folder = tempfile::tempdir().unwrap();
        let files = WorkerFiles::of(&folder.path().join("state"));
        (folder, files)
    }

    #[test]
    fn workers_are_listed_by_their_last_join_with_their_last_name() {
        let (_folder, files) = files();
        assert_eq!(files.joined().unwrap(), []);
        for (minutes, byte, name) in [(1, 1, "mill"), (2, 2, "barn"), (5, 1, "mill\n2")] {
            files.add(&worker(byte, name), at(minutes)).unwrap();
        }
        let listed: Vec<_> =
            files.joined().unwrap().into_iter().map(|it| (it.name, it.first, it.last)).collect();
        assert_eq!(listed, [("mill\\n2".to_owned(), 60, 300), ("barn".to_owned(), 120, 120)]);
    }

    #[test]
    fn a_key_is_revoked_until_it_is_allowed() {
        let (_folder, files) = files();
        let key = KeyHash([7; 32]);
        assert!(!files.allow(key).unwrap());
        files.revoke(key).unwrap();
        assert_eq!(files.revoked().unwrap(), BTreeSet::from([key]));
        assert!(files.allow(key).unwrap());
        assert!(files.revoked().unwrap().is_empty());
    }

    #[test]
    fn a_worker_is_named_by_its_name_its_key_or_the_first_digits() {
        let (_folder, files) = files();
        for (byte, name) in [(1, "mill"), (2, "barn"), (3, "barn")] {
            files.add(&worker(byte, name), at(1)).unwrap();
        }
        for text in ["mill", "01010101", &"01".repeat(32)] {
            assert_eq!(files.find(text), Ok(KeyHash([1; 32])), "{text}");
        }
        assert_eq!(files.find(&"0f".repeat(32)), Ok(KeyHash([15; 32])), "a key that has not joined");
        let several = files.find("barn").unwrap_err();
        assert!(several.contains(&"02".repeat(32)) && several.contains(&"03".repeat(32)), "{several}");
        for text in ["silo", "0101010", ""] {
            assert!(files.find(text).unwrap_err().contains("trust workers"), "{text}");
        }
    }

    #[test]
    fn the_number_of_workers_is_bounded() {
        let (_folder, files) = files();
        let key = |number: usize| {
            let mut bytes = [0; 32];
            bytes[..8].copy_from_slice(&number.to_le_bytes());
            KeyHash(bytes)
        };
        fs::create_dir_all(&files.joined).unwrap();
        // Written without synchronizing each file with the disk, which takes seconds for a thousand files.
        for number in 0..MAX_WORKERS {
            let path = files.joined.join(key(number).to_string());
            fs::write(&path, format!("w\n{number}\n{number}\n")).unwrap();
            #[cfg(unix)]
            {
                use std::os::unix::fs::PermissionsExt;
                fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
            }
        }
        files.add(&JoinedWorker { key: key(MAX_WORKERS), name: "new".to_owned() }, at(600)).unwrap();
        let joined = files.joined().unwrap();
        assert_eq!((joined.len(), joined[0].name.as_str()), (MAX_WORKERS, "new"));
        assert!(joined.iter().all(|worker| worker.key != key(0)), "the oldest is forgotten");
    }
}
