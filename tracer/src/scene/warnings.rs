//! What a file says that was accepted with a shrug. A broken file of a million lines gives a few of them and a count.

use std::path::{Path, PathBuf};

/// Warnings about one file that are told in full.
const MAX_TOLD: usize = 12;

/// Warnings about one file.
pub(super) struct Warnings {
    path: PathBuf,
    told: Vec<String>,
    untold: usize,
}

impl Warnings {
    pub(super) fn about(path: &Path) -> Self {
        Self { path: path.to_owned(), told: Vec::new(), untold: 0 }
    }

    /// About a line, counted from 1.
    pub(super) fn at_line(&mut self, line: usize, message: impl std::fmt::Display) {
        self.push(|path| format!("{}:{line}: {message}", path.display()));
    }

    /// About the file as a whole.
    pub(super) fn at_file(&mut self, message: impl std::fmt::Display) {
        self.push(|path| format!("{}: {message}", path.display()));
    }

    fn push(&mut self, text: impl FnOnce(&Path) -> String) {
        if self.told.len() < MAX_TOLD {
            self.told.push(text(&self.path));
        } else {
            self.untold += 1;
        }
    }

    pub(super) fn into_messages(self) -> Vec<String> {
        let mut messages = self.told;
        if self.untold > 0 {
            messages.push(format!("{}: and {} more warnings", self.path.display(), self.untold));
        }
        messages
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_warnings_is_counted() {
        let mut warnings = Warnings::about(Path::new("a.obj"));
        for line in 1..=100 {
            warnings.at_line(line, "odd");
        }
        let messages = warnings.into_messages();
        assert_eq!(messages.len(), MAX_TOLD + 1);
        assert_eq!(messages[0], "a.obj:1: odd");
        assert_eq!(messages[MAX_TOLD], "a.obj: and 88 more warnings");
    }
}
