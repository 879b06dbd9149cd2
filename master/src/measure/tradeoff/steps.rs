//! Progress of a measurement on standard error: a bar on a terminal, lines otherwise.

use std::io::{self, IsTerminal};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::log_bar;

/// Time between two lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Progress over consecutive parts of a measurement.
pub(crate) struct Steps {
    bar: ProgressBar,
    quiet: bool,
    last_line: Mutex<Instant>,
}

impl Steps {
    /// Creates a progress without parts.
    pub(crate) fn new() -> Self {
        let quiet = !tracing::enabled!(tracing::Level::INFO);
        let target = match io::stderr().is_terminal() && !quiet {
            true => ProgressDrawTarget::stderr(),
            false => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(Some(0), target).with_style(style());
        log_bar::show_below_log(&bar);
        Self { bar, quiet, last_line: Mutex::new(Instant::now()) }
    }

    /// Begins a part of `steps` steps.
    pub(crate) fn part(&self, name: &str, steps: u64) {
        self.bar.set_length(steps);
        self.bar.reset();
        self.bar.set_message(name.to_owned());
        self.line();
    }

    /// Adds finished steps. Any thread may call it.
    pub(crate) fn done(&self, steps: u64) {
        self.bar.inc(steps);
        let late = {
            let mut last = self.last_line.lock().unwrap_or_else(PoisonError::into_inner);
            let late = last.elapsed() >= LINE_EVERY;
            if late {
                *last = Instant::now();
            }
            late
        };
        if late {
            self.line();
        }
    }

    fn line(&self) {
        if self.bar.is_hidden() && !self.quiet {
            let (done, all) = (self.bar.position(), self.bar.length().unwrap_or(0));
            tracing::info!("{}: {:.0} %", self.bar.message(), 100.0 * done as f64 / all.max(1) as f64);
        }
    }
}

impl Drop for Steps {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        log_bar::show_nothing_below_log();
    }
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{msg} {wide_bar} {percent} %, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}
