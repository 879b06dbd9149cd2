//! The masters that a worker has joined, in a file of its state folder.
//!
//! The file is text: a line with the format's version, then a line for each master with its join line and its name, the
//! most recently joined first. No date is kept, because nothing may depend on a clock.

use std::io;
use std::path::{Path, PathBuf};

use rayfarm_protocol::transport::JoinLine;
use rayfarm_text::printable_within;

use super::private_file;

/// Name of the file in the state folder.
const FILE: &str = "masters";

/// First line of the file: the format and its version.
const HEADER: &str = "rayfarm-masters 1";

/// Most masters that are remembered.
const MAX_MASTERS: usize = 64;

/// Longest name of a master, in bytes.
const MAX_NAME_BYTES: usize = 64;

/// Largest file that is read, in bytes.
const MAX_FILE_BYTES: u64 = 256 << 10;

/// A master that a worker has joined.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::app) struct RememberedMaster {
    /// Address, key and token.
    pub(in crate::app) line: JoinLine,
    /// Name in lists: printable, without line breaks.
    pub(in crate::app) name: String,
}

impl RememberedMaster {
    /// Makes an entry. Without a name, the host of the address is the name.
    pub(in crate::app) fn new(line: JoinLine, name: Option<&str>) -> Self {
        let host = line.address.rsplit_once(':').map_or(line.address.as_str(), |(host, _)| host);
        let name = name.map(str::trim).filter(|name| !name.is_empty()).unwrap_or(host);
        let name = printable_within(name, MAX_NAME_BYTES).into_owned();
        Self { line, name }
    }

    /// Whether a name, an address, or at least eight first digits of the key's hash name this master.
    fn is_named(&self, text: &str) -> bool {
        let key = self.line.key.to_string();
        let is_key = text.len() >= 8 && key.starts_with(&text.to_ascii_lowercase());
        self.name == text || self.line.address == text || is_key
    }
}

/// The remembered masters, the most recently joined first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::app) struct MasterList {
    path: PathBuf,
    masters: Vec<RememberedMaster>,
}

impl MasterList {
    /// Loads the list of a state folder. A missing file is an empty list.
    ///
    /// # Errors
    /// A file that other users can access, that has another format, or that cannot be read.
    pub(in crate::app) fn load(folder: &Path) -> io::Result<Self> {
        let path = folder.join(FILE);
        let text = private_file::read(&path, MAX_FILE_BYTES);
        let masters = text.and_then(|text| text.as_deref().map_or(Ok(Vec::new()), parse));
        match masters {
            Ok(masters) => Ok(Self { path, masters }),
            Err(error) => Err(io::Error::new(error.kind(), format!("{}: {error}", path.display()))),
        }
    }

    /// The masters, the most recently joined first.
    pub(in crate::app) fn masters(&self) -> &[RememberedMaster] {
        &self.masters
    }

    /// Puts a master to the front, in place of an entry with the same key. Saves the list where it changes.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(in crate::app) fn remember(&mut self, master: RememberedMaster) -> io::Result<()> {
        if self.masters.first() == Some(&master) {
            return Ok(());
        }
        self.masters.retain(|known| known.line.key != master.line.key);
        self.masters.insert(0, master);
        self.masters.truncate(MAX_MASTERS);
        self.save()
    }

    /// Removes the masters of a name, an address or a key's first digits; all where `text` is `None`. Saves the list and
    /// returns the removed entries.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(in crate::app) fn forget(&mut self, text: Option<&str>) -> io::Result<Vec<RememberedMaster>> {
        let is_removed = |master: &RememberedMaster| text.is_none_or(|text| master.is_named(text));
        let (removed, kept): (Vec<_>, Vec<_>) = self.masters.drain(..).partition(is_removed);
        self.masters = kept;
        if !removed.is_empty() {
            self.save()?;
        }
        Ok(removed)
    }

    fn save(&self) -> io::Result<()> {
        let mut text = format!("{HEADER}\n");
        for RememberedMaster { line, name } in &self.masters {
            text.push_str(&format!("{line} {name}\n"));
        }
        private_file::replace(&self.path, &text)
    }
}

fn parse(text: &str) -> io::Result<Vec<RememberedMaster>> {
    let mut lines = text.lines();
    if lines.next() != Some(HEADER) {
        return Err(io::Error::other(format!(
            "its first line is not {HEADER:?}; delete the file to start anew"
        )));
    }
    let lines = lines.filter(|line| !line.trim().is_empty()).take(MAX_MASTERS);
    let masters = lines.enumerate().map(|(number, entry)| {
        let (line, name) = entry.split_once(' ').unwrap_or((entry, ""));
        let line =
            line.parse().map_err(|error| io::Error::other(format!("entry {}: {error}", number + 1)))?;
        Ok(RememberedMaster::new(line, Some(name)))
    });
    masters.collect()
}

#[cfg(test)]
mod tests {
    use rayfarm_protocol::transport::JoinToken;
    use rayfarm_protocol::transport::KeyHash;

    use super::*;

    fn master(number: u8, token: u8, name: &str) -> RememberedMaster {
        let address = format!("farm{number}:7117");
        let line = JoinLine { address, key: KeyHash([number; 32]), token: JoinToken([token; 16]) };
        RememberedMaster::new(line, Some(name))
    }

    #[test]
    fn masters_are_kept_by_key_with_the_most_recent_first() {
        let folder = tempfile::tempdir().unwrap();
        let mut list = MasterList::load(folder.path()).unwrap();
        assert!(list.masters().is_empty());
        for (number, token) in [(1, 1), (2, 2), (1, 3)] {
            list.remember(master(number, token, "a farm")).unwrap();
        }
        let loaded = MasterList::load(folder.path()).unwrap();
        assert_eq!(loaded.masters(), [master(1, 3, "a farm"), master(2, 2, "a farm")]);
        assert_eq!(loaded, list);
    }

    #[test]
    fn masters_are_forgotten_by_name_address_or_key() {
        let folder = tempfile::tempdir().unwrap();
        let mut list = MasterList::load(folder.path()).unwrap();
        for number in 1..=4 {
            list.remember(master(number, 0, &format!("name{number}"))).unwrap();
        }
        assert_eq!(list.forget(Some("nothing")).unwrap(), []);
        // Seven digits are too few.
        assert_eq!(list.forget(Some("0101010")).unwrap(), []);
        for text in ["name2", "farm3:7117", "01010101"] {
            assert_eq!(list.forget(Some(text)).unwrap().len(), 1, "{text}");
        }
        assert_eq!(MasterList::load(folder.path()).unwrap().masters(), [master(4, 0, "name4")]);
        assert_eq!(list.forget(None).unwrap().len(), 1);
        assert!(MasterList::load(folder.path()).unwrap().masters().is_empty());
    }

    #[test]
    fn names_are_made_printable_and_the_number_of_masters_is_bounded() {
        let folder = tempfile::tempdir().unwrap();
        let mut list = MasterList::load(folder.path()).unwrap();
        for number in 0..=MAX_MASTERS as u8 {
            list.remember(master(number, 0, "x\n\u{1b}[31mrf1:y")).unwrap();
        }
        let loaded = MasterList::load(folder.path()).unwrap();
        assert_eq!(loaded.masters().len(), MAX_MASTERS);
        assert!(loaded.masters().iter().all(|master| !master.name.contains(['\n', '\u{1b}'])));
    }

    #[test]
    fn other_formats_are_errors_without_the_token() {
        let token = "0123456789abcdef0123456789abcdef";
        for text in ["", "rayfarm-masters 2\n", &format!("{HEADER}\nrf1:farm:0:00:{token}\n")] {
            let error = parse(text).unwrap_err().to_string();
            assert!(!error.contains(token), "{error}");
        }
    }
}
