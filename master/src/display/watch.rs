//! Looks whether the window can be seen and has to be drawn again: minifb reports neither.
//!
//! Known on X11 only. Elsewhere a window counts as seen, and is drawn again every second.

use std::time::{Duration, Instant};

use minifb::Window;

use super::sight::{Report, Sight};

/// Where the window system reports nothing, another window may have covered this one: it is drawn again this often.
const REDRAW_EVERY: Duration = Duration::from_secs(1);

/// Watches one window. Drop it before the window.
pub(super) struct Watch {
    sight: Sight,
    reports: Option<x11::Reports>,
    drawn_at: Instant,
}

impl Watch {
    /// Watches `window` from now on.
    pub(super) fn of(window: &Window) -> Self {
        let reports = x11::Reports::of(window);
        let mapped = reports.as_ref().is_none_or(x11::Reports::is_mapped);
        Self { sight: Sight::new(mapped), reports, drawn_at: Instant::now() }
    }

    /// Takes the reports since the last look.
    pub(super) fn look(&mut self) {
        if let Some(reports) = &mut self.reports {
            reports.each(|report| self.sight.take(report));
        } else if self.drawn_at.elapsed() > REDRAW_EVERY {
            self.sight.take(Report::Exposed);
        }
    }

    /// Whether nothing of the window can be seen.
    pub(super) fn is_hidden(&self) -> bool {
        self.sight.is_hidden()
    }

    /// Whether the window has to be drawn although it shows nothing new.
    pub(super) fn take_exposed(&mut self) -> bool {
        self.sight.take_exposed()
    }

    /// The window has been drawn.
    pub(super) fn drawn(&mut self) {
        self.drawn_at = Instant::now();
    }
}

/// A connection of its own to the X server, which reports on minifb's window: events of minifb's connection are read,
/// and thrown away, by minifb.
#[cfg(any(
    target_os = "linux",
    target_os = "freebsd",
    target_os = "dragonfly",
    target_os = "netbsd",
    target_os = "openbsd"
))]
mod x11 {
    use std::ffi::{CStr, c_int, c_long, c_uchar, c_ulong};
    use std::ptr;

    use minifb::Window;
    use raw_window_handle::{HasWindowHandle, RawWindowHandle};
    use x11_dl::xlib;

    use crate::display::screen::x11::Connection;
    use crate::display::sight::Report;

    /// Events that are read in one look at most; the others wait for the next.
    const MAX_EVENTS: c_int = 256;
    /// 32-bit values of a property that are read at most.
    const MAX_VALUES: c_long = 64;
    /// `WM_STATE` of a minimised window (ICCCM 4.1.3.1).
    const ICONIC: c_ulong = 3;

    /// What is reported of one window.
    pub(super) struct Reports {
        connection: Connection,
        window: xlib::Window,
        wm_state: xlib::Atom,
        net_wm_state: xlib::Atom,
        hidden: xlib::Atom,
    }

    impl Reports {
        /// `None` where the window is none of X11, or the server allows no watching.
        pub(super) fn of(window: &Window) -> Option<Self> {
            let RawWindowHandle::Xlib(handle) = window.window_handle().ok()?.as_raw() else { return None };
            let connection = Connection::open()?;
            let mask = xlib::ExposureMask
                | xlib::VisibilityChangeMask
                | xlib::StructureNotifyMask
                | xlib::PropertyChangeMask;
            // SAFETY: the display is open as long as `connection`, and the window exists until minifb drops it, which
            // is after this is dropped. Any client may select these events of any window.
            unsafe { (connection.xlib.XSelectInput)(connection.display, handle.window, mask) };
            let atom = |name| connection.atom(name);
            Some(Self {
                window: handle.window,
                wm_state: atom(c"WM_STATE"),
                net_wm_state: atom(c"_NET_WM_STATE"),
                hidden: atom(c"_NET_WM_STATE_HIDDEN"),
                connection,
            })
        }

        /// Whether the window is on the screen, or would be if its parents were.
        pub(super) fn is_mapped(&self) -> bool {
            let Connection { xlib, display } = &self.connection;
            // SAFETY: plain data for which all zeros are valid values; display and window are as in `of`. Zero is
            // returned where nothing was written.
            unsafe {
                let mut attributes: xlib::XWindowAttributes = std::mem::zeroed();
                (xlib.XGetWindowAttributes)(*display, self.window, &mut attributes) == 0
                    || attributes.map_state != xlib::IsUnmapped
            }
        }

        /// Hands over what has been reported since the last time. Does not wait.
        pub(super) fn each(&mut self, mut take: impl FnMut(Report)) {
            let Connection { xlib, display } = &self.connection;
            // SAFETY: the display is open as long as `self`. XNextEvent does not wait, as XPending says how many
            // events are there, and fills in the whole event. The members of the union that are read are those of the
            // event's type.
            unsafe {
                for _ in 0..(xlib.XPending)(*display).min(MAX_EVENTS) {
                    let mut event: xlib::XEvent = std::mem::zeroed();
                    (xlib.XNextEvent)(*display, &mut event);
                    match event.get_type() {
                        xlib::Expose => take(Report::Exposed),
                        xlib::MapNotify => take(Report::Mapped(true)),
                        xlib::UnmapNotify => take(Report::Mapped(false)),
                        xlib::VisibilityNotify => {
                            take(Report::Covered(event.visibility.state == xlib::VisibilityFullyObscured));
                        }
                        xlib::PropertyNotify
                            if [self.wm_state, self.net_wm_state].contains(&event.property.atom) =>
                        {
                            take(Report::Minimised(self.is_minimised()));
                        }
                        _ => {}
                    }
                }
            }
        }

        fn is_minimised(&self) -> bool {
            let state = self.values(self.wm_state, self.wm_state);
            let states = self.values(self.net_wm_state, xlib::XA_ATOM);
            state.first() == Some(&ICONIC) || states.contains(&self.hidden)
        }

        /// A property's 32-bit values; empty where it is not there, or of another type.
        fn values(&self, property: xlib::Atom, kind: xlib::Atom) -> Vec<c_ulong> {
            let Connection { xlib, display } = &self.connection;
            let (mut found, mut format, mut count, mut left) = (0, 0, 0, 0);
            let mut data: *mut c_uchar = ptr::null_mut();
            // SAFETY: display and window are as in `of`, and all pointers are to variables of the types that are
            // asked for. Of 32-bit values Xlib returns `count` of C's long, whatever its size, that are the caller's
            // to read until they are freed; the slice ends before that.
            unsafe {
                let status = (xlib.XGetWindowProperty)(
                    *display,
                    self.window,
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
                    Ok(count) if is_sound => {
                        std::slice::from_raw_parts(data.cast::<c_ulong>(), count).to_vec()
                    }
                    _ => Vec::new(),
                };
                (xlib.XFree)(data.cast());
                values
            }
        }
    }

    impl Connection {
        fn atom(&self, name: &CStr) -> xlib::Atom {
            let Self { xlib, display } = self;
            // SAFETY: the display is open as long as `self`, and the name ends with a zero.
            unsafe { (xlib.XInternAtom)(*display, name.as_ptr(), xlib::False) }
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
    use minifb::Window;

    use crate::display::sight::Report;

    /// No X here.
    pub(super) enum Reports {}

    impl Reports {
        /// Nothing is reported.
        pub(super) fn of(_: &Window) -> Option<Self> {
            None
        }

        pub(super) fn is_mapped(&self) -> bool {
            true
        }

        pub(super) fn each(&mut self, _: impl FnMut(Report)) {}
    }
}
