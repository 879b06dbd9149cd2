//! The displays of one view: their numbers, and which of them can be seen.

use std::collections::BTreeMap;

/// Number of a display of a view, in the order in which they were added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct DisplayId(pub(super) u32);

impl DisplayId {
    /// The display that decides the size of the picture; all others scale it.
    pub(super) const FIRST: Self = Self(0);
}

/// Visibility of all displays.
#[derive(Debug, Default)]
pub(super) struct Visibility {
    /// Last report of each display that has sent one.
    visible: BTreeMap<DisplayId, bool>,
}

impl Visibility {
    /// Records whether any part of a display can be seen.
    pub(super) fn report(&mut self, display: DisplayId, visible: bool) {
        self.visible.insert(display, visible);
    }

    /// Whether no display can be seen, as far as they have reported it. Then no frame is requested.
    pub(super) fn is_hidden(&self) -> bool {
        !self.visible.is_empty() && self.visible.values().all(|visible| !visible)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_is_hidden_when_no_display_can_be_seen() {
        let mut visibility = Visibility::default();
        assert!(!visibility.is_hidden(), "no display has reported yet");
        let (window, web) = (DisplayId::FIRST, DisplayId(1));
        visibility.report(web, false);
        assert!(visibility.is_hidden());
        visibility.report(window, true);
        assert!(!visibility.is_hidden());
        visibility.report(window, false);
        assert!(visibility.is_hidden());
        visibility.report(web, true);
        assert!(!visibility.is_hidden());
    }
}
