//! The terminal's state: taken over for the display, and restored at its end, after a panic and for a stop in the background.

use std::io::{self, Write};
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

use crossterm::event::{DisableMouseCapture, EnableMouseCapture};
use crossterm::terminal::{
    DisableLineWrap, EnableLineWrap, EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode,
    enable_raw_mode,
};
use crossterm::{cursor, execute};

/// Whether the terminal is taken over. One process has one terminal.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// The terminal while the display has it. Dropping it restores the terminal.
#[derive(Debug)]
pub(super) struct TerminalGuard(());

impl TerminalGuard {
    /// Takes the terminal over: alternate screen, no echo, no cursor, mouse reports.
    ///
    /// # Errors
    /// A terminal that cannot be set up.
    pub(super) fn take() -> io::Result<Self> {
        restore_after_panic();
        enter()?;
        Ok(Self(()))
    }

    /// Restores the terminal, stops this process as Ctrl-Z does, and takes the terminal over again when the process goes on.
    ///
    /// # Errors
    /// A terminal that cannot be set up again.
    #[cfg(unix)]
    pub(super) fn stop_in_background(&self) -> io::Result<()> {
        restore();
        signal_hook::low_level::emulate_default_handler(signal_hook::consts::SIGTSTP)?;
        enter()
    }
}

impl Drop for TerminalGuard {
    fn drop(&mut self) {
        restore();
    }
}

fn enter() -> io::Result<()> {
    enable_raw_mode()?;
    TAKEN.store(true, Ordering::Release);
    let mut out = io::stdout().lock();
    execute!(out, EnterAlternateScreen, cursor::Hide, DisableLineWrap, EnableMouseCapture)
}

/// Restores the terminal if the display has it. It may be called more than once, and from any thread.
pub(crate) fn restore() {
    if !TAKEN.swap(false, Ordering::AcqRel) {
        return;
    }
    let mut out = io::stdout().lock();
    // The program ends or stops: no output is left for a failure.
    let _ = execute!(out, DisableMouseCapture, EnableLineWrap, cursor::Show, LeaveAlternateScreen);
    let _ = out.flush();
    let _ = disable_raw_mode();
}

/// Makes the message of a panic visible: it would be written to the alternate screen.
fn restore_after_panic() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let report = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            restore();
            report(info);
        }));
    });
}
