//! Whether anything of the window can be seen, from what the window system reports.

/// A report of the window system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Report {
    /// A part of the window has lost what it showed.
    Exposed,
    /// The window is on the screen, or is taken off it.
    Mapped(bool),
    /// Other windows cover all of it, or no longer do.
    Covered(bool),
    /// The window manager has minimised it, or brought it back.
    Minimised(bool),
}

/// What can be seen of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sight {
    mapped: bool,
    covered: bool,
    minimised: bool,
    /// Whether it has to be drawn again, though it shows nothing new.
    exposed: bool,
}

impl Sight {
    /// A window that is on the screen, or not yet.
    pub(super) fn new(mapped: bool) -> Self {
        Self { mapped, covered: false, minimised: false, exposed: true }
    }

    /// Takes note of a report.
    pub(super) fn take(&mut self, report: Report) {
        let was_hidden = self.is_hidden();
        match report {
            Report::Exposed => self.exposed = true,
            Report::Mapped(mapped) => {
                // What covers it is reported anew once it is there.
                (self.mapped, self.covered) = (mapped, false);
            }
            Report::Covered(covered) => self.covered = covered,
            Report::Minimised(minimised) => self.minimised = minimised,
        }
        self.exposed |= was_hidden && !self.is_hidden();
    }

    /// Whether nothing of it can be seen.
    pub(super) fn is_hidden(&self) -> bool {
        !self.mapped || self.covered || self.minimised
    }

    /// Whether it has to be drawn again; asking answers for the reports so far. Nothing is drawn where nothing is seen.
    pub(super) fn take_exposed(&mut self) -> bool {
        !self.is_hidden() && std::mem::take(&mut self.exposed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(reports: &[Report]) -> Sight {
        let mut sight = Sight::new(true);
        assert!(sight.take_exposed(), "a new window is drawn");
        reports.iter().for_each(|&report| sight.take(report));
        sight
    }

    #[test]
    fn a_window_is_hidden_while_it_is_unmapped_covered_or_minimised() {
        for report in [
            Report::Mapped as fn(bool) -> Report,
            |gone| Report::Covered(!gone),
            |gone| Report::Minimised(!gone),
        ] {
            let hidden = after(&[report(false)]);
            assert!(hidden.is_hidden(), "{hidden:?}");
            let mut back = after(&[report(false), report(true)]);
            assert!(!back.is_hidden() && back.take_exposed(), "what comes back is drawn again: {back:?}");
            assert!(!back.take_exposed(), "once");
        }
        assert!(Sight::new(false).is_hidden());
    }

    #[test]
    fn one_reason_ends_and_the_other_stays() {
        let sight = after(&[Report::Covered(true), Report::Minimised(true), Report::Covered(false)]);
        assert!(sight.is_hidden());
    }

    #[test]
    fn a_window_that_is_mapped_again_is_not_covered_by_what_covered_it_before() {
        let sight = after(&[Report::Covered(true), Report::Mapped(false), Report::Mapped(true)]);
        assert!(!sight.is_hidden());
    }

    #[test]
    fn what_is_exposed_while_it_is_hidden_is_drawn_when_it_is_back() {
        let mut sight = after(&[Report::Minimised(true), Report::Exposed]);
        assert!(!sight.take_exposed());
        sight.take(Report::Minimised(false));
        assert!(sight.take_exposed());
    }
}
