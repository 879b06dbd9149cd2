//! Reading of regular files within limits, atomic writing, and changes of files.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::SystemTime;

/// Opens a regular file for reading; links are followed.
///
/// # Errors
/// Errors of the operating system; a folder, pipe, socket or device, which is refused before it is opened: opening a
/// pipe waits for a writer, and opening a device may have effects.
pub fn open_regular(path: &Path) -> io::Result<File> {
    require_regular(&fs::metadata(path)?)?;
    let file = File::open(path)?;
    // The name may refer to another file by now.
    require_regular(&file.metadata()?)?;
    Ok(file)
}

fn require_regular(metadata: &fs::Metadata) -> io::Result<()> {
    if metadata.is_file() {
        return Ok(());
    }
    let (kind, what) = if metadata.is_dir() {
        (io::ErrorKind::IsADirectory, "it is a folder; a file was expected")
    } else {
        (io::ErrorKind::InvalidInput, "it is a pipe, a socket or a device; a regular file was expected")
    };
    Err(io::Error::new(kind, what))
}

/// All bytes of a regular file, or `None` if it has more than `limit`; of a larger file none are read.
///
/// # Errors
/// As [`open_regular`]; too little memory.
pub fn read_within(path: &Path, limit: u64) -> io::Result<Option<Vec<u8>>> {
    let file = open_regular(path)?;
    // Memory for all of it at once: a compiled model may have hundreds of megabytes.
    let announced = file.metadata()?.len();
    if announced > limit {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(announced).unwrap_or(usize::MAX))?;
    // A file may grow while it is read, and a pseudo file system announces no sizes.
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    Ok(Some(bytes).filter(|bytes| bytes.len() as u64 <= limit))
}

/// The state of a file at one time, to find out whether it has changed since then: its size and the time of its last
/// change. Changes that keep the size, within the resolution of the file system's clock, are not found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileStamp {
    path: PathBuf,
    /// `None` where there is no such file.
    state: Option<(u64, Option<SystemTime>)>,
}

impl FileStamp {
    /// The state of a file now; links are followed.
    pub fn of(path: &Path) -> Self {
        Self { path: path.to_owned(), state: Self::state(path) }
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the file has changed, appeared or disappeared since then.
    pub fn has_changed(&self) -> bool {
        Self::state(&self.path) != self.state
    }

    fn state(path: &Path) -> Option<(u64, Option<SystemTime>)> {
        let metadata = fs::metadata(path).ok()?;
        Some((metadata.len(), metadata.modified().ok()))
    }
}

/// Writes a file under a new temporary name in the same folder and renames it.
///
/// # Errors
/// Errors of the operating system. An existing file is then unchanged, and no temporary file is left.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let (temporary, mut file) = Temporary::create_next_to(path)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    // Closed before it is renamed: Windows does not rename open files.
    drop(file);
    temporary.rename_to(path)
}

/// A new file that is removed when dropped unless it was renamed.
#[derive(Debug)]
pub struct Temporary {
    path: Option<PathBuf>,
}

impl Temporary {
    /// Creates a new file in the folder of `target`. An existing link of that name is not followed.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn create_next_to(target: &Path) -> io::Result<(Self, File)> {
        // Process and counter make the name unique, so that no two writers share a temporary file.
        static COUNTER: AtomicU32 = AtomicU32::new(0);
        loop {
            let mut name = OsString::from(".");
            name.push(target.file_name().ok_or(io::ErrorKind::InvalidInput)?);
            let serial = COUNTER.fetch_add(1, Ordering::Relaxed);
            name.push(format!(".{}-{serial}.partial", std::process::id()));
            let path = target.with_file_name(name);
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((Self { path: Some(path) }, file)),
                // Left by a killed process with this id: in containers ids are reused soon.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && serial < u32::MAX => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.path.as_deref().unwrap_or(Path::new(""))
    }

    /// Renames the file, replacing an existing one.
    ///
    /// # Errors
    /// Errors of the operating system; the file is then removed.
    pub fn rename_to(mut self, target: &Path) -> io::Result<()> {
        if let Some(path) = &self.path {
            fs::rename(path, target)?;
        }
        self.path = None;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some(path) = &self.path {
            // Ignored: the cause has been reported already.
            let _ = fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_no_other_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.rfm");
        write_whole(&path, b"first").unwrap();
        write_whole(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn changes_of_a_file_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let absent = FileStamp::of(&path);
        assert!(!absent.has_changed() && absent.path() == path);
        fs::write(&path, "1").unwrap();
        let first = FileStamp::of(&path);
        assert!(absent.has_changed() && !first.has_changed());
        let later = SystemTime::now() + std::time::Duration::from_secs(7);
        File::options().write(true).open(&path).unwrap().set_modified(later).unwrap();
        assert!(first.has_changed(), "the time differs");
        let second = FileStamp::of(&path);
        fs::remove_file(&path).unwrap();
        assert!(second.has_changed() && !absent.has_changed());
    }

    #[test]
    fn a_failed_write_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).unwrap();
        fs::write(taken.join("inside"), "x").unwrap();
        assert!(write_whole(&taken, b"bytes").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn files_beyond_the_limit_are_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, b"12345").unwrap();
        assert_eq!(read_within(&path, 5).unwrap().as_deref(), Some(&b"12345"[..]));
        assert_eq!(read_within(&path, 4).unwrap(), None);
    }

    #[cfg(unix)]
    #[test]
    fn pipes_devices_and_folders_are_refused_also_behind_links() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        // There is never a writer: opening the pipe for reading would block permanently.
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        for (target, words) in
            [(pipe.as_path(), "a pipe"), (Path::new("/dev/zero"), "a device"), (folder.path(), "a folder")]
        {
            let link = folder.path().join("link");
            symlink(target, &link).unwrap();
            for path in [target, &link] {
                let message = open_regular(path).unwrap_err().to_string();
                assert!(message.contains(words), "{}: {message}", path.display());
            }
            fs::remove_file(&link).unwrap();
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_place_of_the_temporary_file_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (path, victim) = (folder.path().join("a.csv"), folder.path().join("victim"));
        fs::write(&victim, "precious").unwrap();
        // Other tests of this process may advance the counter, so every name that may come next is taken.
        for serial in 0..500 {
            let name = format!(".a.csv.{}-{serial}.partial", std::process::id());
            std::os::unix::fs::symlink(&victim, folder.path().join(name)).unwrap();
        }
        write_whole(&path, b"table").unwrap();
        assert_eq!(fs::read(&victim).unwrap(), b"precious");
        assert_eq!(fs::read(&path).unwrap(), b"table");
    }
}
