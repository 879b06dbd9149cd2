//! The progress bar below the log on a terminal.

use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};

use indicatif::ProgressBar;

use crate::log_lines;

/// The bar on the terminal, if there is one. Lines of the log are written above it.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Writes lines of the log above this bar from now on, if it is visible.
pub(crate) fn show_below_log(bar: &ProgressBar) {
    if !bar.is_hidden() {
        *BAR.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar.clone());
    }
}

/// Ends the special treatment of a bar by the log.
pub(crate) fn show_nothing_below_log() {
    *BAR.lock().unwrap_or_else(PoisonError::into_inner) = None;
}

/// Writer to standard error, above the progress bar if there is one.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LogWriter;

impl Write for LogWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if !log_lines::record(bytes) {
            return Ok(bytes.len());
        }
        let bar = BAR.lock().unwrap_or_else(PoisonError::into_inner).clone();
        match bar {
            Some(bar) => bar.suspend(|| io::stderr().write(bytes)),
            None => io::stderr().write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}
