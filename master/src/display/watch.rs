//! Visibility and exposure of the window, which minifb does not report.
//!
//! Known on X11 only. Elsewhere a window counts as visible, and is drawn again every second.

use std::time::{Duration, Instant};

use minifb::Window;

use super::visibility::{Visibility, WindowEvent};
use super::x11::WindowEvents;

/// Interval of drawing where the window system reports no exposure: another window may have covered this one.
const REDRAW_EVERY: Duration = Duration::from_secs(1);

/// Watch over one window. It must be dropped before the window.
pub(super) struct WindowWatch {
    visibility: Visibility,
    events: Option<WindowEvents>,
    drawn_at: Instant,
}

impl WindowWatch {
    /// Watches `window` from now on.
    pub(super) fn of(window: &Window) -> Self {
        let events = WindowEvents::of(window);
        let mapped = events.as_ref().is_none_or(WindowEvents::is_mapped);
        Self { visibility: Visibility::new(mapped), events, drawn_at: Instant::now() }
    }

    /// Takes the events since the last call.
    pub(super) fn update(&mut self) {
        if let Some(events) = &mut self.events {
            events.drain(|event| self.visibility.apply(event));
        } else if self.drawn_at.elapsed() > REDRAW_EVERY {
            self.visibility.apply(WindowEvent::Exposed);
        }
    }

    /// Whether no part of the window can be seen.
    pub(super) fn is_hidden(&self) -> bool {
        self.visibility.is_hidden()
    }

    /// Whether the window must be drawn although its content has not changed. Clears that state.
    pub(super) fn take_exposed(&mut self) -> bool {
        self.visibility.take_exposed()
    }

    /// Records that the window has been drawn.
    pub(super) fn drawn(&mut self) {
        self.drawn_at = Instant::now();
    }
}
