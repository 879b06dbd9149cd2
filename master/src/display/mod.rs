//! Displays: each shows a view and sends its input, over a [`ViewerHandle`].
//!
//! The window is one display; `render`, which writes frames to files, is another. The window and its input live on the main
//! thread, as window systems require; the viewer runs on tokio's threads. Neither ever waits for the other.

mod canvas;
mod input;
pub(crate) mod numbers;
mod overlay;
mod screen;
mod tint;
mod visibility;
mod watch;
mod window;
mod worker_selection;
mod x11;

pub(crate) use window::{SceneInfo, WindowDisplay};

use crate::viewer::ViewerHandle;

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
