//! The material libraries of a model: the files that its `mtllib` lines name, and substitutes for missing ones.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::super::LoadOptions;
use super::super::foreign::{Wanted, recognised};
use super::super::lookup::{Found, Lookup, Missing, tidy};
use super::super::printed::excerpt;
use super::super::read::{MAX_LIBRARY_BYTES, bytes};
use super::super::text::decoded;
use super::super::warnings::Warnings;
use super::geometry::MaterialRun;
use super::materials::{self, Library};
use super::picture::Place;
use super::slots::find;
use crate::files::FileStamp;

/// Largest number of libraries of one model.
const MAX_LIBRARIES: usize = 1024;

/// Largest size of all libraries of one model, in bytes.
const MAX_TOTAL_BYTES: u64 = 4 * MAX_LIBRARY_BYTES;

/// Largest number of words in a name with blanks.
const MAX_WORDS: usize = 16;

/// Reads all libraries that a model names, each once. Returns their materials and the warnings about their contents, and adds
/// the files that it reads or misses, with their state before that.
pub(super) fn read(
    model: &Path,
    lines: &[(usize, String)],
    runs: &[MaterialRun],
    options: LoadOptions,
    warnings: &mut Warnings,
    stamps: &mut Vec<FileStamp>,
) -> (Library, Vec<String>) {
    let folder = model.parent().unwrap_or(Path::new(""));
    let mut reader = Reader {
        // Libraries outside of the folder are never read.
        files: Lookup::new(folder, false),
        pictures: Lookup::new(folder, options.allow_parent_textures),
        known: BTreeSet::new(),
        bytes: 0,
        library: Library::new(),
        messages: Vec::new(),
        missing: Vec::new(),
        folder,
        stamps,
    };
    let mut names = BTreeSet::new();
    for (line, text) in lines {
        let is_there = |name: &str| reader.files.find_here(Path::new(""), name).is_ok();
        for name in split(text, is_there) {
            if names.len() < MAX_LIBRARIES && names.insert(name.to_owned()) {
                reader.named(*line, name, warnings);
            } else if !names.contains(name) {
                let message =
                    format!("more than {MAX_LIBRARIES} material libraries: the others are left out");
                warnings.once("too many libraries", *line, message);
            }
        }
    }
    reader.finish(model, runs, warnings)
}

struct Reader<'p> {
    files: Lookup<'p>,
    pictures: Lookup<'p>,
    /// Paths of the libraries that have been read.
    known: BTreeSet<PathBuf>,
    bytes: u64,
    library: Library,
    messages: Vec<String>,
    /// Missing libraries, with the lines that name them.
    missing: Vec<(usize, String, Missing)>,
    folder: &'p Path,
    stamps: &'p mut Vec<FileStamp>,
}

impl Reader<'_> {
    /// Adds the materials of a library that a line names.
    fn named(&mut self, line: usize, name: &str, warnings: &mut Warnings) {
        let found = match self.files.find(Path::new(""), name) {
            Ok(found) => found,
            Err(reason) => {
                // Created later, it changes the model.
                if reason == Missing::NotThere {
                    self.stamps.push(FileStamp::of(&self.folder.join(tidy(name))));
                }
                return self.missing.push((line, tidy(name), reason));
            }
        };
        if !self.known.insert(found.path.clone()) {
            return;
        }
        if !found.as_named {
            let (name, instead) = (excerpt(name, 100), excerpt(&found.name, 100));
            let message = format!("the material library `{name}` is not there: `{instead}` is taken");
            warnings.once("library elsewhere", line, message);
        }
        match self.parsed(&found) {
            Ok((materials, messages)) => {
                self.library.extend(materials);
                self.messages.extend(messages);
            }
            Err(reason) => {
                let message =
                    format!("material library: {reason}; its materials are drawn with the neutral one");
                warnings.once(&message, line, &message);
            }
        }
    }

    fn parsed(&mut self, found: &Found) -> Result<(Library, Vec<String>), String> {
        self.stamps.push(FileStamp::of(&found.path));
        let content = bytes(&found.path, MAX_LIBRARY_BYTES).map_err(|error| error.to_string())?;
        let name = excerpt(&found.name, 100);
        self.bytes += content.len() as u64;
        if self.bytes > MAX_TOTAL_BYTES {
            return Err(format!("{name}: the libraries of the model have more than {MAX_TOTAL_BYTES} bytes"));
        }
        if let Some(foreign) = recognised(&content) {
            return Err(format!("{name}: {}", foreign.refusal(Wanted::Library)));
        }
        let mut about = Warnings::about(&found.path);
        let inner = Path::new(&found.name).parent().unwrap_or(Path::new(""));
        let place = Place { pictures: &self.pictures, inner };
        let materials = materials::parse(&decoded(&content), &place, &mut about);
        Ok((materials, about.into_messages()))
    }

    /// Reports missing libraries, unless a library with the model's name defines their materials.
    fn finish(
        mut self,
        model: &Path,
        runs: &[MaterialRun],
        warnings: &mut Warnings,
    ) -> (Library, Vec<String>) {
        let instead = if self.defines_all(runs) { None } else { self.named_like(model, runs) };
        if let Some(name) = &instead {
            let name = excerpt(name, 100);
            let taken = format!("`{name}`, named like the model, is taken");
            match self.missing.first() {
                Some((line, missing, _)) => {
                    let missing = excerpt(missing, 100);
                    warnings
                        .at_line(*line, format!("the material library `{missing}` is not there: {taken}"));
                }
                None => {
                    warnings.at_file(format!("no `mtllib` line names the library of its materials: {taken}"))
                }
            }
        }
        for (line, name, reason) in self.missing.iter().skip(usize::from(instead.is_some())) {
            let message = missing_message(&excerpt(name, 100), *reason);
            warnings.once(&message, *line, &message);
        }
        // A missing library is reported already, and its materials are not reported again.
        if self.missing.is_empty() || instead.is_some() {
            warn_of_unknown(runs, &self.library, warnings);
        }
        (self.library, self.messages)
    }

    fn defines_all(&self, runs: &[MaterialRun]) -> bool {
        unknown(runs, &self.library).next().is_none()
    }

    /// Adds the library in the model's folder with its name (`chair.mtl` for `chair.obj`), if it defines missing
    /// materials.
    fn named_like(&mut self, model: &Path, runs: &[MaterialRun]) -> Option<String> {
        let name = format!("{}.mtl", model.file_stem()?.to_str()?);
        let found = self.files.find_here(Path::new(""), &name).ok()?;
        if self.known.contains(&found.path) {
            return None;
        }
        let (materials, messages) = self.parsed(&found).ok()?;
        if !unknown(runs, &self.library).any(|(name, _)| find(&materials, name).is_some()) {
            return None;
        }
        for (name, material) in materials {
            self.library.entry(name).or_insert(material);
        }
        self.messages.extend(messages);
        Some(found.name)
    }
}

fn missing_message(name: &str, reason: Missing) -> String {
    let what = match reason {
        Missing::NotThere => format!("the material library `{name}` is not in the model's folder"),
        Missing::Absolute | Missing::Above | Missing::Link => {
            format!(
                "the material library `{name}` is outside the model's folder and is not read; put it there"
            )
        }
    };
    format!("{what}; its materials are drawn with the neutral one")
}

/// Materials that no library defines, with the lines of their first use.
fn unknown<'r>(runs: &'r [MaterialRun], library: &Library) -> impl Iterator<Item = (&'r str, usize)> {
    let mut seen = BTreeSet::new();
    let named = runs.iter().filter_map(|run| Some((run.material.as_deref()?, run.line)));
    named.filter(move |(name, _)| seen.insert(*name) && find(library, name).is_none())
}

/// Reports all undefined materials in one warning.
fn warn_of_unknown(runs: &[MaterialRun], library: &Library, warnings: &mut Warnings) {
    const LISTED: usize = 5;
    let mut rest = unknown(runs, library).peekable();
    let Some((_, line)) = rest.peek().copied() else { return };
    let listed: Vec<String> =
        rest.by_ref().take(LISTED).map(|(name, _)| format!("`{}`", excerpt(name, 60))).collect();
    let more = match rest.count() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let listed = listed.join(", ");
    warnings.at_line(
        line,
        format!("no material library defines {listed}{more}: drawn with the neutral material"),
    );
}

/// The names on an `mtllib` line. Names may contain blanks, so the longest name of an existing file counts; where
/// there is none, a name ends with `.mtl`. A `#` in place of a name begins a comment.
fn split(text: &str, is_there: impl Fn(&str) -> bool) -> Vec<&str> {
    let mut names = Vec::new();
    let mut rest = text.trim_ascii();
    while !rest.is_empty() && names.len() <= MAX_LIBRARIES {
        let quoted = rest.strip_prefix('"').and_then(|rest| rest.split_once('"'));
        let (name, behind) = match quoted {
            Some(parts) => parts,
            None => {
                let ends = word_ends(rest);
                let longest = ends.iter().rev().find(|end| rest.get(..**end).is_some_and(&is_there));
                if longest.is_none() && rest.starts_with('#') {
                    break;
                }
                rest.split_at_checked(longest.copied().unwrap_or_else(|| end_of_missing(rest, &ends)))
                    .unwrap_or((rest, ""))
            }
        };
        if !name.is_empty() {
            names.push(name);
        }
        rest = behind.trim_ascii_start();
    }
    names
}

/// Offsets of the ends of the first words.
fn word_ends(text: &str) -> Vec<usize> {
    let bytes = text.as_bytes();
    let ends = (1..=bytes.len()).filter(|end| {
        let blank = |index: usize| bytes.get(index).is_none_or(u8::is_ascii_whitespace);
        !blank(end - 1) && blank(*end)
    });
    ends.take(MAX_WORDS).collect()
}

/// Offset of the end of a missing file's name: behind `.mtl`, before a comment, or the end of the text.
fn end_of_missing(text: &str, ends: &[usize]) -> usize {
    let is_library = |end: &&usize| {
        let tail = text.as_bytes().get(end.saturating_sub(4)..**end);
        tail.is_some_and(|tail| tail.eq_ignore_ascii_case(b".mtl"))
    };
    let seen = text.get(..ends.last().copied().unwrap_or_default()).unwrap_or(text);
    let comment = seen.find(" #").unwrap_or(seen.len());
    ends.iter().find(is_library).copied().unwrap_or(comment).min(comment)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_on_a_line_are_separated_by_existing_files() {
        let there = ["my mats.mtl", "other.mtl", "a #1.mtl", "plain", "two words", "my\\ mats.mtl"];
        for (text, names) in [
            ("other.mtl", &["other.mtl"][..]),
            ("my mats.mtl", &["my mats.mtl"]),
            ("my mats.mtl other.mtl", &["my mats.mtl", "other.mtl"]),
            ("other.mtl\tmy mats.mtl # materials", &["other.mtl", "my mats.mtl"]),
            ("other.mtl # inline comment", &["other.mtl"]),
            ("a #1.mtl other.mtl", &["a #1.mtl", "other.mtl"]),
            ("\"my mats.mtl\" \"no such.mtl\" # x", &["my mats.mtl", "no such.mtl"]),
            ("my\\ mats.mtl", &["my\\ mats.mtl"]),
            ("plain two words", &["plain", "two words"]),
            ("no such.mtl other.mtl", &["no such.mtl", "other.mtl"]),
            ("none.mtl nor this.MTL # x", &["none.mtl", "nor this.MTL"]),
            ("no ending # x", &["no ending"]),
            ("no ending", &["no ending"]),
            ("# x", &[]),
            ("", &[]),
            ("\"\"", &[]),
        ] {
            assert_eq!(split(text, |name| there.contains(&name)), names, "{text}");
        }
    }

    #[test]
    fn a_line_of_many_words_takes_few_lookups() {
        let looks = std::cell::Cell::new(0);
        let is_there = |_: &str| {
            looks.set(looks.get() + 1);
            false
        };
        assert_eq!(split(&"a.mtl ".repeat(1000), is_there).len(), 1000);
        assert!(looks.get() <= 1000 * MAX_WORDS);
    }
}
