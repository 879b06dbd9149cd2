//! Connection to the X server, and the check of its pixel depth.

use std::ffi::{CStr, c_int, c_long, c_uchar, c_ulong};
use std::ptr;

use x11_dl::xlib::{self, Display, Xlib};

/// 32-bit values of a property that are read at most.
const MAX_VALUES: c_long = 64;

/// An open connection to the X server that `$DISPLAY` names; closed when dropped.
pub(super) struct Connection {
    pub(super) xlib: Xlib,
    pub(super) display: *mut Display,
}

impl Connection {
    /// Opens a connection; `None` without Xlib or without a server that accepts clients.
    pub(super) fn open() -> Option<Self> {
        let xlib = Xlib::open().ok()?;
        // SAFETY: XInitThreads must precede all other Xlib calls of the process, and the first of these is here; it may be
        // called again. XOpenDisplay takes null for the display that $DISPLAY names and returns null where it cannot
        // connect.
        let display = unsafe {
            (xlib.XInitThreads)();
            (xlib.XOpenDisplay)(ptr::null())
        };
        // Only a value with a display exists: it is closed when this is dropped.
        (!display.is_null()).then(|| Self { xlib, display })
    }

    /// The atom of a name.
    pub(super) fn atom(&self, name: &CStr) -> xlib::Atom {
        // SAFETY: the display is open as long as `self`, and the name ends with a zero.
        unsafe { (self.xlib.XInternAtom)(self.display, name.as_ptr(), xlib::False) }
    }

    /// The 32-bit values of a window's property; empty where the property is absent or of another type.
    ///
    /// The window must exist.
    pub(super) fn property(
        &self,
        window: xlib::Window,
        property: xlib::Atom,
        kind: xlib::Atom,
    ) -> Vec<c_ulong> {
        let (mut found, mut format, mut count, mut left) = (0, 0, 0, 0);
        let mut data: *mut c_uchar = ptr::null_mut();
        // SAFETY: the display is open as long as `self`, and all pointers are to variables of the requested types. Of 32-bit
        // values Xlib returns `count` of C's long, whatever its size, that the caller may read until it frees them; the
        // slice ends before that.
        unsafe {
            let status = (self.xlib.XGetWindowProperty)(
                self.display,
                window,
                property,
                0,
                MAX_VALUES,
                xlib::False,
                kind,
                &mut found,
                &mut format,
                &mut count,
                &mut left,
                &mut data,
            );
            if data.is_null() {
                return Vec::new();
            }
            let is_sound = status == c_int::from(xlib::Success) && found == kind && format == 32;
            let values = match usize::try_from(count) {
                Ok(count) if is_sound => std::slice::from_raw_parts(data.cast::<c_ulong>(), count).to_vec(),
                _ => Vec::new(),
            };
            (self.xlib.XFree)(data.cast());
            values
        }
    }

    /// Bits that a pixel of the default screen takes in memory.
    fn bits_per_pixel(&self) -> Option<i32> {
        let Self { xlib, display } = self;
        let mut count = 0;
        // SAFETY: the display is open until `self` is dropped. XListPixmapFormats returns null, or an array of `count`
        // formats that the caller may read until it frees it with XFree; the slice ends before that.
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

impl Drop for Connection {
    fn drop(&mut self) {
        // SAFETY: `open` opened the display, this is its only closing, and nothing uses it afterwards.
        unsafe { (self.xlib.XCloseDisplay)(self.display) };
    }
}

/// Check that minifb survives the X screen: minifb 0.29 needs 32 bits a pixel. It notices a screen without them, but then
/// frees the screen's graphics context twice and dies of a segmentation fault, so the check comes before minifb.
///
/// Keep the value until the window is open: a server without clients resets itself, and refuses the next one meanwhile.
pub(in crate::display) struct DepthCheck {
    _connection: Option<Connection>,
}

impl DepthCheck {
    /// Checks the screen. Where there is no X server the check succeeds, and minifb reports the problem.
    ///
    /// # Errors
    /// A screen whose pixels do not have 32 bits.
    pub(in crate::display) fn new() -> Result<Self, String> {
        if std::env::var_os("WAYLAND_DISPLAY").is_some() {
            return Ok(Self { _connection: None }); // minifb tries Wayland first
        }
        let connection = Connection::open();
        match connection.as_ref().and_then(Connection::bits_per_pixel) {
            Some(bits) if bits != 32 => Err(format!(
                "the screen has {bits} bits per pixel; a depth of 24 with 32 bits per pixel is needed"
            )),
            _ => Ok(Self { _connection: connection }),
        }
    }
}
