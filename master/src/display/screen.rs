//! Opening the window, or saying clearly why there is none.

use minifb::{ScaleMode, Window, WindowOptions};

/// Opens a window whose inside has the given size.
///
/// # Errors
/// Why there is no display, in words for the user.
pub(super) fn open(title: &str, width: u32, height: u32) -> Result<Window, String> {
    let _probe = x11::Probe::new()?;
    let options =
        WindowOptions { resize: true, scale_mode: ScaleMode::UpperLeft, ..WindowOptions::default() };
    Window::new(title, width as usize, height as usize, options).map_err(|error| error.to_string())
}

/// minifb 0.29 needs 32 bits a pixel. It does notice an X screen without them, but then frees the screen's graphics
/// context twice and dies of a segmentation fault, so the screen is looked at before minifb is asked.
#[cfg(any(
    target_os = "linux",
    target_os = "freebsd",
    target_os = "dragonfly",
    target_os = "netbsd",
    target_os = "openbsd"
))]
pub(super) mod x11 {
    use std::ptr;

    use x11_dl::xlib::{Display, Xlib};

    /// A connection to the X screen, if there is one, that minifb would survive too.
    ///
    /// Keep it until the window is open: a server without clients resets itself, and would refuse the next one meanwhile.
    pub(in crate::display) struct Probe(Option<Connection>);

    /// An open connection to the X server that `$DISPLAY` names; closed when dropped.
    pub(in crate::display) struct Connection {
        pub(in crate::display) xlib: Xlib,
        pub(in crate::display) display: *mut Display,
    }

    impl Probe {
        /// Refuses an X screen whose pixels do not have 32 bits. One that cannot be asked is left to minifb's report.
        pub(in crate::display) fn new() -> Result<Self, String> {
            if std::env::var_os("WAYLAND_DISPLAY").is_some() {
                return Ok(Self(None)); // minifb tries Wayland first
            }
            let probe = Self(Connection::open());
            match probe.bits_per_pixel() {
                Some(bits) if bits != 32 => Err(format!(
                    "the screen has {bits} bits per pixel; a depth of 24 with 32 bits per pixel is needed"
                )),
                _ => Ok(probe),
            }
        }

        /// Bits that a pixel of the default screen takes in memory.
        fn bits_per_pixel(&self) -> Option<i32> {
            let Connection { xlib, display } = self.0.as_ref()?;
            let mut count = 0;
            // SAFETY: the display is open until `self` is dropped. XListPixmapFormats returns null, or an array of
            // `count` formats that is the caller's to read until it is freed with XFree; the slice ends before that.
            unsafe {
                let depth = (xlib.XDefaultDepth)(*display, (xlib.XDefaultScreen)(*display));
                let formats = (xlib.XListPixmapFormats)(*display, &mut count);
                if formats.is_null() {
                    return None;
                }
                let bits = std::slice::from_raw_parts(formats, usize::try_from(count).unwrap_or(0))
                    .iter()
                    .find(|format| format.depth == depth)
                    .map(|format| format.bits_per_pixel);
                (xlib.XFree)(formats.cast());
                bits
            }
        }
    }

    impl Connection {
        /// `None` where there is no X, or no server that takes clients.
        pub(in crate::display) fn open() -> Option<Self> {
            let xlib = Xlib::open().ok()?;
            // SAFETY: XInitThreads has no precondition but to come before all other Xlib calls of the process, and the
            // first of these is here; it may be called again. XOpenDisplay takes null for "what $DISPLAY names" and
            // returns null where it cannot connect.
            let display = unsafe {
                (xlib.XInitThreads)();
                (xlib.XOpenDisplay)(ptr::null())
            };
            // Made only where there is a display: it is closed when this is dropped.
            (!display.is_null()).then(|| Self { xlib, display })
        }
    }

    impl Drop for Connection {
        fn drop(&mut self) {
            // SAFETY: `open` opened the display, this is its only closing, and nothing uses it after.
            unsafe { (self.xlib.XCloseDisplay)(self.display) };
        }
    }
}

#[cfg(not(any(
    target_os = "linux",
    target_os = "freebsd",
    target_os = "dragonfly",
    target_os = "netbsd",
    target_os = "openbsd"
)))]
mod x11 {
    /// No X here.
    pub(in crate::display) struct Probe;

    impl Probe {
        /// Nothing to refuse.
        pub(in crate::display) fn new() -> Result<Self, String> {
            Ok(Self)
        }
    }
}
