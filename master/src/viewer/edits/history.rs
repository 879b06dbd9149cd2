//! Former and later texts of a scene.

use std::collections::VecDeque;

/// Most changes that can be undone.
const MAX_CHANGES: usize = 256;
/// Most bytes of former texts.
const MAX_BYTES: usize = 64 << 20;

/// A change: its description, and the text before it (to undo) or after it (to redo).
#[derive(Clone, Debug)]
struct Change {
    what: String,
    text: String,
}

/// The text of a scene, and the texts to undo and to redo.
#[derive(Debug)]
pub(super) struct History {
    current: String,
    undo: VecDeque<Change>,
    redo: Vec<Change>,
}

impl History {
    /// A history without changes.
    pub(super) fn new(text: String) -> Self {
        Self { current: text, undo: VecDeque::new(), redo: Vec::new() }
    }

    /// The current text.
    pub(super) fn text(&self) -> &str {
        &self.current
    }

    /// Adds a change. The oldest changes beyond the bounds are dropped.
    pub(super) fn change(&mut self, what: String, text: String) {
        let former = std::mem::replace(&mut self.current, text);
        self.undo.push_back(Change { what, text: former });
        self.redo.clear();
        let mut bytes: usize = self.undo.iter().map(|change| change.text.len()).sum();
        while self.undo.len() > MAX_CHANGES || bytes > MAX_BYTES {
            let Some(oldest) = self.undo.pop_front() else { break };
            bytes -= oldest.text.len();
        }
    }

    /// The text before the last change, and the description of that change.
    pub(super) fn former(&self) -> Option<(&str, &str)> {
        self.undo.back().map(|change| (change.text.as_str(), change.what.as_str()))
    }

    /// The text after the change that was undone last, and the description of that change.
    pub(super) fn later(&self) -> Option<(&str, &str)> {
        self.redo.last().map(|change| (change.text.as_str(), change.what.as_str()))
    }

    /// Undoes the last change.
    pub(super) fn undo(&mut self) {
        if let Some(Change { what, text }) = self.undo.pop_back() {
            let text = std::mem::replace(&mut self.current, text);
            self.redo.push(Change { what, text });
        }
    }

    /// Repeats the change that was undone last.
    pub(super) fn redo(&mut self) {
        if let Some(Change { what, text }) = self.redo.pop() {
            let text = std::mem::replace(&mut self.current, text);
            self.undo.push_back(Change { what, text });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_undone_and_repeated_in_order() {
        let mut history = History::new("0".into());
        ["1", "2"].iter().for_each(|text| history.change(format!("to {text}"), (*text).into()));
        assert_eq!(history.former(), Some(("1", "to 2")));
        history.undo();
        history.undo();
        assert_eq!((history.text(), history.former()), ("0", None));
        history.undo();
        assert_eq!((history.text(), history.later()), ("0", Some(("1", "to 1"))));
        history.redo();
        assert_eq!((history.text(), history.later()), ("1", Some(("2", "to 2"))));
        history.change("to 3".into(), "3".into());
        assert_eq!((history.later(), history.former()), (None, Some(("1", "to 3"))));
    }

    #[test]
    fn the_oldest_changes_are_dropped() {
        let mut history = History::new("0".into());
        (1..=MAX_CHANGES + 9).for_each(|n| history.change(String::new(), n.to_string()));
        let undone = std::iter::from_fn(|| history.former().is_some().then(|| history.undo())).count();
        assert_eq!((undone, history.text()), (MAX_CHANGES, "9"));
        let mut history = History::new("x".repeat(MAX_BYTES / 2));
        (0..4).for_each(|_| history.change(String::new(), "y".repeat(MAX_BYTES / 2)));
        assert_eq!(history.undo.len(), 2);
    }
}
