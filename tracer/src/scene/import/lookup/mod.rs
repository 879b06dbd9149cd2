//! Lookup of files that a model names: its material libraries and pictures. Only the model's folder is searched,
//! because an untrusted model must not make the program read other files. In it, files are found under names of other
//! disks and systems as well: with back slashes, in another case, by the last parts of an absolute path.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::text::decoded_name;

/// Number of entries of a folder that are examined.
const MAX_ENTRIES: usize = 1 << 16;

/// Longest name in bytes; no system has longer ones.
const MAX_NAME: usize = 4096;

/// Number of last parts of a name that are tried as a path inside of the folder.
const MAX_PARTS: usize = 8;

/// Finds files in a model's folder and below it.
pub(in crate::scene) struct Lookup<'p> {
    folder: &'p Path,
    /// The folder with links resolved; `None` if it cannot be read.
    real_folder: Option<PathBuf>,
    /// Whether relative names and links may lead out of the folder.
    may_leave: bool,
    /// Entries of folders by [`folded`] name, listed on demand.
    listings: RefCell<BTreeMap<PathBuf, BTreeMap<String, OsString>>>,
}

/// A file that was found.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::scene) struct Found {
    /// Path from the folder, with `/` between its parts.
    pub(in crate::scene) name: String,
    /// Path to open.
    pub(in crate::scene) path: PathBuf,
    /// Whether it is at the named path, character for character.
    pub(in crate::scene) as_named: bool,
}

/// Reason why a file was not found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::scene) enum Missing {
    /// There is no file of that name, or of its last parts.
    NotThere,
    /// The name is an absolute path, and no file has its last parts.
    Absolute,
    /// The name leads out of the folder by `..`.
    Above,
    /// A link leads out of the folder.
    Link,
}

impl<'p> Lookup<'p> {
    pub(in crate::scene) fn new(folder: &'p Path, may_leave: bool) -> Self {
        let anchor = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let real_folder = anchor.canonicalize().ok();
        Self { folder, real_folder, may_leave, listings: RefCell::default() }
    }

    /// Finds a file by a name that was read in a file of the folder `inner`, which is relative to the model's.
    pub(in crate::scene) fn find(&self, inner: &Path, name: &str) -> Result<Found, Missing> {
        let missing = match self.find_here(inner, name) {
            Ok(found) => return Ok(found),
            Err(missing) => missing,
        };
        if name.len() > MAX_NAME {
            return Err(missing);
        }
        let last_parts = |spelling: &String| self.by_last_parts(inner, &Name::new(inner, spelling));
        spellings(name).iter().find_map(last_parts).ok_or(missing)
    }

    /// Finds a file like [`Lookup::find`], but not by the last parts of its name.
    pub(in crate::scene) fn find_here(&self, inner: &Path, name: &str) -> Result<Found, Missing> {
        let mut missing = Missing::NotThere;
        if name.len() > MAX_NAME {
            return Err(missing);
        }
        for spelling in spellings(name) {
            match self.here(&Name::new(inner, &spelling)) {
                Ok(found) => return Ok(found),
                Err(reason) => missing = missing.max(reason),
            }
        }
        Err(missing)
    }

    /// Path to open for a path found earlier, by this program or another: the file may have been renamed in its case,
    /// or its name may have another encoding.
    pub(in crate::scene) fn path(&self, way: &str) -> PathBuf {
        let direct = self.folder.join(way);
        if direct.exists() {
            return direct;
        }
        let name = Name::new(Path::new(""), way);
        let found = if name.absolute { None } else { self.walk(&name.parts) };
        found.map_or(direct, |found| found.path)
    }

    /// The named path where no file is; `None` if it leads out of the folder.
    pub(in crate::scene) fn way(&self, inner: &Path, name: &str) -> Option<String> {
        let name = Name::new(inner, &tidy(name));
        let permitted = !name.absolute && (self.may_leave || !name.leads_out());
        permitted.then(|| name.parts.join("/")).filter(|way| !way.is_empty())
    }

    fn here(&self, name: &Name) -> Result<Found, Missing> {
        if name.absolute {
            return Err(Missing::Absolute);
        }
        if name.leads_out() && !self.may_leave {
            return Err(Missing::Above);
        }
        let found = self.walk(&name.parts).ok_or(Missing::NotThere)?;
        if self.is_permitted(&found.path) { Ok(found) } else { Err(Missing::Link) }
    }

    /// Tries as many last parts of the name as possible, in the folder `inner`, then in the model's folder.
    fn by_last_parts(&self, inner: &Path, name: &Name) -> Option<Found> {
        let parts: Vec<String> = name.parts.iter().filter(|part| *part != "..").cloned().collect();
        let inner = Name::new(inner, "").parts;
        let most = parts.len().min(MAX_PARTS);
        (0..most).map(|left_out| parts.get(parts.len() - most + left_out..).unwrap_or_default()).find_map(
            |last| {
                let in_inner = [inner.as_slice(), last].concat();
                let found = self.walk(&in_inner).or_else(|| self.walk(last))?;
                self.is_permitted(&found.path).then_some(Found { as_named: false, ..found })
            },
        )
    }

    /// The file at these parts. The case may differ if there is no exact match.
    fn walk(&self, parts: &[String]) -> Option<Found> {
        let mut path = self.folder.to_owned();
        let mut real_parts: Vec<String> = Vec::new();
        let mut as_named = true;
        if parts.is_empty() {
            return None;
        }
        let direct = parts.iter().fold(path.clone(), |path, part| path.join(part));
        if direct.is_file() {
            return Some(Found { name: parts.join("/"), path: direct, as_named });
        }
        for part in parts {
            if part == ".." || path.join(part).exists() {
                path.push(part);
                real_parts.push(part.clone());
            } else {
                let real = self.entry(&path, part)?;
                real_parts.push(decoded_name(&real).into_owned());
                path.push(real);
                as_named = false;
            }
        }
        path.is_file().then(|| Found { name: real_parts.join("/"), path, as_named })
    }

    fn entry(&self, folder: &Path, name: &str) -> Option<OsString> {
        let mut listings = self.listings.borrow_mut();
        let listing = listings.entry(folder.to_owned()).or_insert_with(|| listing(folder));
        listing.get(&folded(name)).cloned()
    }

    /// Whether links inside the folder do not lead out of it.
    fn is_permitted(&self, path: &Path) -> bool {
        self.may_leave
            || match (&self.real_folder, path.canonicalize()) {
                (Some(folder), Ok(real)) => real.starts_with(folder),
                _ => false,
            }
    }
}

/// The entries of a folder; of those that differ in case only, the first in byte order.
fn listing(folder: &Path) -> BTreeMap<String, OsString> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().take(MAX_ENTRIES);
    let mut names: Vec<OsString> = entries.map(|entry| entry.file_name()).collect();
    names.sort();
    names.into_iter().rev().map(|name| (folded(&decoded_name(&name)), name)).collect()
}

fn folded(name: &str) -> String {
    name.to_lowercase()
}

/// A name as a path from the model's folder.
#[derive(Debug, PartialEq)]
struct Name {
    /// Whether it names a drive, a host, or the root of a disk.
    absolute: bool,
    /// Parts without `.`; `..` at the beginning only.
    parts: Vec<String>,
}

impl Name {
    fn new(inner: &Path, name: &str) -> Self {
        let name = name.replace('\\', "/");
        let absolute = name.starts_with('/') || name.contains(':');
        let mut all = Self { absolute, parts: Vec::new() };
        if !absolute {
            inner.components().for_each(|part| all.push(&part.as_os_str().to_string_lossy()));
        }
        // `C:wood.png` is a name on a drive.
        name.split('/').for_each(|part| all.push(part.rsplit(':').next().unwrap_or_default()));
        all
    }

    fn push(&mut self, part: &str) {
        match part {
            "" | "." => {}
            ".." if self.parts.last().is_some_and(|last| last != "..") => drop(self.parts.pop()),
            ".." if self.absolute => {}
            part => self.parts.push(part.to_owned()),
        }
    }

    fn leads_out(&self) -> bool {
        self.parts.first().is_some_and(|part| part == "..")
    }
}

/// Interpretations of a name, likeliest first: unchanged; without quotes or a comment; with unescaped blanks;
/// percent-decoded.
fn spellings(name: &str) -> Vec<String> {
    let tidy = tidy(name);
    let unescaped = tidy.replace("\\ ", " ");
    let decoded = percent_decoded(&unescaped);
    let mut all = vec![name.trim_ascii().to_owned()];
    for spelling in [Some(tidy), Some(unescaped), decoded].into_iter().flatten() {
        if !all.contains(&spelling) {
            all.push(spelling);
        }
    }
    all
}

/// The name without surrounding quotes, or without a trailing comment.
pub(in crate::scene) fn tidy(name: &str) -> String {
    let name = name.trim_ascii();
    for quote in ['"', '\''] {
        if let Some((quoted, _)) = name.strip_prefix(quote).and_then(|rest| rest.split_once(quote)) {
            return quoted.trim_ascii().to_owned();
        }
    }
    without_comment(name).to_owned()
}

/// The text before a `#` that follows a blank.
fn without_comment(text: &str) -> &str {
    let comment = text
        .match_indices('#')
        .find(|(at, _)| text.get(..*at).is_some_and(|before| before.ends_with([' ', '\t'])));
    comment.and_then(|(at, _)| text.get(..at)).unwrap_or(text).trim_ascii_end()
}

fn percent_decoded(name: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let Some((first, others)) = rest.split_first() {
        let code = others.get(..2).filter(|_| *first == b'%');
        let code = code.and_then(|code| u8::from_str_radix(std::str::from_utf8(code).ok()?, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { others.get(2..).unwrap_or_default() } else { others };
    }
    String::from_utf8(bytes).ok().filter(|decoded| decoded != name && !decoded.contains('\0'))
}

#[cfg(test)]
mod tests;
