//! Visibility of the window, from events of the window system.

/// An event of the window system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WindowEvent {
    /// A part of the window has lost its content.
    Exposed,
    /// The window was put on the screen, or taken off it.
    Mapped(bool),
    /// Other windows cover the whole window, or no longer do.
    Covered(bool),
    /// The window manager has minimised or restored the window.
    Minimised(bool),
}

/// Visibility of one window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Visibility {
    mapped: bool,
    covered: bool,
    minimised: bool,
    /// Whether the window must be drawn although its content has not changed.
    exposed: bool,
}

impl Visibility {
    /// Visibility of a new window, which is on the screen or not yet.
    pub(super) fn new(mapped: bool) -> Self {
        Self { mapped, covered: false, minimised: false, exposed: true }
    }

    /// Applies an event.
    pub(super) fn apply(&mut self, event: WindowEvent) {
        let was_hidden = self.is_hidden();
        match event {
            WindowEvent::Exposed => self.exposed = true,
            WindowEvent::Mapped(mapped) => {
                // The system reports anew which windows cover it once it is mapped.
                (self.mapped, self.covered) = (mapped, false);
            }
            WindowEvent::Covered(covered) => self.covered = covered,
            WindowEvent::Minimised(minimised) => self.minimised = minimised,
        }
        self.exposed |= was_hidden && !self.is_hidden();
    }

    /// Whether no part of the window can be seen.
    pub(super) fn is_hidden(&self) -> bool {
        !self.mapped || self.covered || self.minimised
    }

    /// Whether the window must be drawn again; clears that state. A hidden window is not drawn.
    pub(super) fn take_exposed(&mut self) -> bool {
        !self.is_hidden() && std::mem::take(&mut self.exposed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(events: &[WindowEvent]) -> Visibility {
        let mut visibility = Visibility::new(true);
        assert!(visibility.take_exposed(), "a new window is drawn");
        events.iter().for_each(|&event| visibility.apply(event));
        visibility
    }

    #[test]
    fn a_window_is_hidden_while_it_is_unmapped_covered_or_minimised() {
        for event in [
            WindowEvent::Mapped as fn(bool) -> WindowEvent,
            |gone| WindowEvent::Covered(!gone),
            |gone| WindowEvent::Minimised(!gone),
        ] {
            let hidden = after(&[event(false)]);
            assert!(hidden.is_hidden(), "{hidden:?}");
            let mut back = after(&[event(false), event(true)]);
            assert!(!back.is_hidden() && back.take_exposed(), "a restored window is drawn again: {back:?}");
            assert!(!back.take_exposed(), "once");
        }
        assert!(Visibility::new(false).is_hidden());
    }

    #[test]
    fn a_window_stays_hidden_while_one_reason_lasts() {
        let visibility =
            after(&[WindowEvent::Covered(true), WindowEvent::Minimised(true), WindowEvent::Covered(false)]);
        assert!(visibility.is_hidden());
    }

    #[test]
    fn a_window_that_is_mapped_again_is_not_covered_by_the_windows_of_before() {
        let visibility =
            after(&[WindowEvent::Covered(true), WindowEvent::Mapped(false), WindowEvent::Mapped(true)]);
        assert!(!visibility.is_hidden());
    }

    #[test]
    fn a_window_that_is_exposed_while_hidden_is_drawn_when_it_is_visible() {
        let mut visibility = after(&[WindowEvent::Minimised(true), WindowEvent::Exposed]);
        assert!(!visibility.take_exposed());
        visibility.apply(WindowEvent::Minimised(false));
        assert!(visibility.take_exposed());
    }
}
