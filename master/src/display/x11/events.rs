//! Events of minifb's window, over a connection of their own: minifb reads those of its connection and drops them.

use std::ffi::{c_int, c_ulong};

use minifb::Window;
use raw_window_handle::{HasWindowHandle, RawWindowHandle};
use x11_dl::xlib;

use super::connection::Connection;
use crate::display::visibility::WindowEvent;

/// Events that are read in one call at most; the others wait for the next one.
const MAX_EVENTS: c_int = 256;
/// `WM_STATE` of a minimised window (ICCCM 4.1.3.1).
const ICONIC: c_ulong = 3;

/// Event stream of one window. It must be dropped before the window.
pub(in crate::display) struct WindowEvents {
    connection: Connection,
    window: xlib::Window,
    wm_state: xlib::Atom,
    net_wm_state: xlib::Atom,
    hidden: xlib::Atom,
}

impl WindowEvents {
    /// Events of `window` from now on; `None` where it is not a window of X, or the server allows no second client.
    pub(in crate::display) fn of(window: &Window) -> Option<Self> {
        let RawWindowHandle::Xlib(handle) = window.window_handle().ok()?.as_raw() else { return None };
        let connection = Connection::open()?;
        let mask = xlib::ExposureMask
            | xlib::VisibilityChangeMask
            | xlib::StructureNotifyMask
            | xlib::PropertyChangeMask;
        // SAFETY: the display is open as long as `connection`, and the window exists until minifb drops it, which is after
        // this is dropped. Any client may select these events of any window.
        unsafe { (connection.xlib.XSelectInput)(connection.display, handle.window, mask) };
        Some(Self {
            window: handle.window,
            wm_state: connection.atom(c"WM_STATE"),
            net_wm_state: connection.atom(c"_NET_WM_STATE"),
            hidden: connection.atom(c"_NET_WM_STATE_HIDDEN"),
            connection,
        })
    }

    /// Whether the window is on the screen, or would be if its parents were.
    pub(in crate::display) fn is_mapped(&self) -> bool {
        let Connection { xlib, display } = &self.connection;
        // SAFETY: all zeros are a valid value of the plain struct; display and window are as in `of`. The call returns zero
        // where it has written nothing.
        unsafe {
            let mut attributes: xlib::XWindowAttributes = std::mem::zeroed();
            (xlib.XGetWindowAttributes)(*display, self.window, &mut attributes) == 0
                || attributes.map_state != xlib::IsUnmapped
        }
    }

    /// Passes on the events since the last call. Does not wait.
    pub(in crate::display) fn drain(&mut self, mut receive: impl FnMut(WindowEvent)) {
        let Connection { xlib, display } = &self.connection;
        // SAFETY: the display is open as long as `self`. XNextEvent does not wait, because XPending has counted the events,
        // and fills in the whole event. Of the union, only members of the event's type are read.
        unsafe {
            for _ in 0..(xlib.XPending)(*display).min(MAX_EVENTS) {
                let mut event: xlib::XEvent = std::mem::zeroed();
                (xlib.XNextEvent)(*display, &mut event);
                match event.get_type() {
                    xlib::Expose => receive(WindowEvent::Exposed),
                    xlib::MapNotify => receive(WindowEvent::Mapped(true)),
                    xlib::UnmapNotify => receive(WindowEvent::Mapped(false)),
                    xlib::VisibilityNotify => {
                        receive(WindowEvent::Covered(
                            event.visibility.state == xlib::VisibilityFullyObscured,
                        ));
                    }
                    xlib::PropertyNotify
                        if [self.wm_state, self.net_wm_state].contains(&event.property.atom) =>
                    {
                        receive(WindowEvent::Minimised(self.is_minimised()));
                    }
                    _ => {}
                }
            }
        }
    }

    fn is_minimised(&self) -> bool {
        let values = |property, kind| self.connection.property(self.window, property, kind);
        values(self.wm_state, self.wm_state).first() == Some(&ICONIC)
            || values(self.net_wm_state, xlib::XA_ATOM).contains(&self.hidden)
    }
}
