//! Pictures on a screen.
//!
//! The window and its input live on the main thread, as window systems want it; the farm lives on tokio's threads.
//! Between them stands the viewer's frame loop: the newest camera goes one way, the newest picture the other, and neither side ever
//! waits for the other, so a slow farm does not freeze the window and a slow screen does not slow the farm.

mod canvas;
mod input;
pub(crate) mod overlay;
mod screen;
mod sight;
mod steering;
mod tint;
mod watch;
pub(crate) mod window;
