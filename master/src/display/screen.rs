//! Opening of the window.

use minifb::{ScaleMode, Window, WindowOptions};

use super::x11::DepthCheck;

/// Opens a window whose inside has the given size, in pixels.
///
/// # Errors
/// The reason for which there is no display, in words for the user.
pub(super) fn open(title: &str, width: u32, height: u32) -> Result<Window, String> {
    let _check = DepthCheck::new()?;
    let options =
        WindowOptions { resize: true, scale_mode: ScaleMode::UpperLeft, ..WindowOptions::default() };
    Window::new(title, width as usize, height as usize, options).map_err(|error| error.to_string())
}
