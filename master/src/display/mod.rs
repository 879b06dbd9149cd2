//! Displays: each shows a view and sends its input, over a [`ViewerHandle`].
//!
//! The window is one display, the terminal and the web page are others, and `render`, which writes frames to files, is one as
//! well. The window and its input live on the main thread, as window systems require; the viewer runs on tokio's threads. Neither
//! ever waits for the other.
//! In a build without the feature `window`, a replacement reports that there is none.

#[cfg(not(feature = "window"))]
mod absent;
#[cfg(feature = "window")]
mod canvas;
#[cfg(feature = "window")]
mod input;
pub(crate) mod numbers;
#[cfg(feature = "window")]
mod overlay;
#[cfg(feature = "window")]
mod screen;
#[cfg(feature = "terminal")]
pub(crate) mod terminal;
#[cfg(feature = "window")]
mod tint;
#[cfg(feature = "window")]
mod visibility;
#[cfg(feature = "window")]
mod watch;
#[cfg(feature = "web")]
pub(crate) mod web;
#[cfg(feature = "window")]
mod window;
#[cfg(feature = "window")]
mod worker_selection;
#[cfg(feature = "window")]
mod x11;

#[cfg(not(feature = "window"))]
pub(crate) use absent::WindowDisplay;
#[cfg(feature = "window")]
pub(crate) use window::WindowDisplay;

use crate::viewer::ViewerHandle;

/// Restores the terminal if a display has taken it over, before the process ends at once.
pub(crate) fn restore_terminal() {
    #[cfg(feature = "terminal")]
    terminal::restore();
    crate::log_lines::release();
}

/// Facts about the scene and its farm that a display shows.
#[derive(Clone, Debug)]
#[cfg_attr(not(feature = "window"), allow(dead_code, reason = "only the window shows all of them"))]
pub(crate) struct SceneInfo {
    /// Name of the scene, for the title.
    pub(crate) name: String,
    /// Triangles over all instances.
    pub(crate) triangles: u64,
    /// Workers that the master starts itself.
    pub(crate) local_workers: u32,
}

/// A display of a view.
pub(crate) trait Display {
    /// Shows the view until the user quits or the viewer ends. Blocks the calling thread.
    ///
    /// # Errors
    /// A display that cannot go on.
    fn run(self, viewer: ViewerHandle) -> Result<(), DisplayError>;
}

/// Reason for which a display ended early.
#[derive(Debug, thiserror::Error)]
pub(crate) enum DisplayError {
    /// A screen that accepts no more pictures, or a file that cannot be written.
    #[error("{0}")]
    Failed(String),
    /// Ctrl-C or SIGTERM came before the last frame.
    #[error("interrupted")]
    Interrupted,
}
