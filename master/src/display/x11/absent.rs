//! Replacement on systems without X: every query returns nothing.

use minifb::Window;

use crate::display::visibility::WindowEvent;

/// Check that always succeeds.
pub(in crate::display) struct DepthCheck;

impl DepthCheck {
    /// Succeeds.
    pub(in crate::display) fn new() -> Result<Self, String> {
        Ok(Self)
    }
}

/// Events of a window; no value exists.
pub(in crate::display) enum WindowEvents {}

impl WindowEvents {
    /// Returns `None`.
    pub(in crate::display) fn of(_: &Window) -> Option<Self> {
        None
    }

    pub(in crate::display) fn is_mapped(&self) -> bool {
        true
    }

    pub(in crate::display) fn drain(&mut self, _: impl FnMut(WindowEvent)) {}
}
