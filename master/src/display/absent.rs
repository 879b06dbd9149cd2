//! Replacement of the window in builds without the feature `window`.

use super::{Display, DisplayError, SceneInfo};
use crate::viewer::ViewerHandle;

/// Reason for which no window can be opened.
const PROBLEM: &str = "this build of rayfarm-master has no window (its feature `window` is off)";

/// Window of a build that has none; no value exists.
pub(crate) enum WindowDisplay {}

impl WindowDisplay {
    /// Checks that this build has a window.
    ///
    /// # Errors
    /// Always: the missing feature.
    pub(crate) fn check_build() -> Result<(), String> {
        Err(PROBLEM.to_owned())
    }

    /// Opens no window.
    ///
    /// # Errors
    /// Always: the missing feature.
    pub(crate) fn open(_info: SceneInfo, _width: u32, _height: u32) -> Result<Self, String> {
        Err(PROBLEM.to_owned())
    }
}

impl Display for WindowDisplay {
    fn run(self, _viewer: ViewerHandle) -> Result<(), DisplayError> {
        match self {}
    }
}
