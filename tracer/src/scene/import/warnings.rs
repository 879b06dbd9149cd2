//! Warnings about a file that was accepted with losses. Each kind is reported once, with the line of its first case
//! and the number of cases: a broken file of a million lines gives a few warnings.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use super::printed::escaped;

/// Number of kinds of warnings about one file that are reported in full.
const MAX_KINDS: usize = 24;

/// Warnings about one file.
pub(in crate::scene) struct Warnings {
    path: PathBuf,
    /// Kinds in the order of their first cases.
    kinds: Vec<Kind>,
    /// Number of cases of other kinds.
    others: usize,
}

struct Kind {
    name: String,
    /// Line of the first case, counted from 1; `None` for the file as a whole.
    line: Option<usize>,
    /// Message of the first case.
    message: String,
    cases: usize,
}

impl Warnings {
    pub(in crate::scene) fn about(path: &Path) -> Self {
        Self { path: path.to_owned(), kinds: Vec::new(), others: 0 }
    }

    /// Warns about a line, counted from 1. Further lines of the same kind are only counted.
    pub(in crate::scene) fn once(&mut self, kind: &str, line: usize, message: impl Display) {
        self.push(kind, Some(line), message);
    }

    /// Warns about a line, counted from 1. Further lines with the same message, apart from quotes in `...`, are only
    /// counted.
    pub(in crate::scene) fn at_line(&mut self, line: usize, message: impl Display) {
        let message = message.to_string();
        self.push(&without_quotes(&message), Some(line), &message);
    }

    /// Warns about the file as a whole. Further messages of the same kind are only counted.
    pub(in crate::scene) fn once_in_file(&mut self, kind: &str, message: impl Display) {
        self.push(kind, None, message);
    }

    /// Warns about the file as a whole.
    pub(in crate::scene) fn at_file(&mut self, message: impl Display) {
        let message = message.to_string();
        self.push(&message, None, &message);
    }

    fn push(&mut self, kind: &str, line: Option<usize>, message: impl Display) {
        if let Some(known) = self.kinds.iter_mut().find(|known| known.name == kind) {
            known.cases += 1;
        } else if self.kinds.len() < MAX_KINDS {
            let (name, message) = (kind.to_owned(), message.to_string());
            self.kinds.push(Kind { name, line, message, cases: 1 });
        } else {
            self.others += 1;
        }
    }

    pub(in crate::scene) fn into_messages(self) -> Vec<String> {
        let path = escaped(&self.path.display().to_string());
        let mut messages: Vec<String> = self.kinds.iter().map(|kind| kind.report(&path)).collect();
        if self.others > 0 {
            messages.push(format!("{path}: and {} more warnings of other kinds", self.others));
        }
        messages
    }
}

/// A message without its quotes.
fn without_quotes(message: &str) -> String {
    message.split('`').step_by(2).collect()
}

impl Kind {
    fn report(&self, path: &str) -> String {
        let Self { line, cases, .. } = self;
        let message = escaped(&self.message);
        match (line, cases) {
            (None, 1) => format!("{path}: {message}"),
            (None, cases) => format!("{path}: {message} ({cases} times)"),
            (Some(line), 1) => format!("{path}:{line}: {message}"),
            (Some(line), cases) => format!("{path}:{line}: {message} ({cases} lines of this kind)"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_reported_once_with_its_count() {
        let mut warnings = Warnings::about(Path::new("a.obj"));
        for line in 1..=100 {
            warnings.at_line(line, "odd");
            warnings.once("colour", line, format_args!("colour {line} is odd"));
            warnings.at_line(line, format_args!("`name {line}` is odd"));
        }
        warnings.at_line(7, "even");
        warnings.at_file("no end");
        warnings.at_file("no end");
        let expected = [
            "a.obj:1: odd (100 lines of this kind)",
            "a.obj:1: colour 1 is odd (100 lines of this kind)",
            "a.obj:1: `name 1` is odd (100 lines of this kind)",
            "a.obj:7: even",
            "a.obj: no end (2 times)",
        ];
        assert_eq!(warnings.into_messages(), expected);
    }

    #[test]
    fn kinds_beyond_the_limit_are_counted() {
        let mut warnings = Warnings::about(Path::new("a\n.obj"));
        for line in 1..=100 {
            warnings.at_line(line, format_args!("odd\n{line}"));
        }
        let messages = warnings.into_messages();
        assert_eq!(messages.len(), MAX_KINDS + 1);
        assert_eq!(messages[0], "a\\n.obj:1: odd\\n1");
        assert_eq!(messages[MAX_KINDS], "a\\n.obj: and 76 more warnings of other kinds");
    }
}
