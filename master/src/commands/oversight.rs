//! What watches and steers a run: `--trace` and `--control`.

use tokio_util::sync::CancellationToken;

use crate::accounting::{TimelineError, TimelineFile};
use crate::cli::OversightArgs;
use crate::control::{self, Console, Place};
use crate::error::CommandError;
use crate::farm::Farm;

/// As asked for on the command line.
pub(super) struct Oversight {
    trace: Option<TimelineFile>,
    control: Option<Place>,
    /// Cancelled when the run is over.
    over: CancellationToken,
}

impl Oversight {
    /// Creates the trace's file.
    ///
    /// # Errors
    /// A place that cannot be written.
    pub(super) fn new(args: &OversightArgs) -> Result<Self, CommandError> {
        let trace = args.trace.as_deref().map(TimelineFile::create).transpose().map_err(refused)?;
        Ok(Self { trace, control: args.control.clone(), over: CancellationToken::new() })
    }

    /// Watches a farm from now on, and takes commands for it; `quit` is cancelled where they end the run. Call it inside
    /// a runtime.
    ///
    /// # Errors
    /// A place that cannot be listened at.
    pub(super) fn begin(&self, farm: &Farm, quit: &CancellationToken) -> Result<(), CommandError> {
        if let Some(trace) = &self.trace {
            farm.record_timeline(trace.sink());
        }
        match &self.control {
            Some(place) => {
                let console = Console::new(farm.control(), quit.clone());
                control::start(place, console, self.over.clone())
            }
            None => Ok(()),
        }
    }

    /// The run is over: no more commands are taken, and the trace is written to its end.
    ///
    /// # Errors
    /// A trace that could not be written.
    pub(super) fn end(&mut self) -> Result<(), CommandError> {
        self.over.cancel();
        self.trace.take().map_or(Ok(()), |trace| trace.finish().map_err(refused))
    }
}

/// A path that cannot be written is wrong input; a full disk is not.
fn refused(error: TimelineError) -> CommandError {
    match error {
        TimelineError::Create { .. } | TimelineError::NotSeekable { .. } => CommandError::wrong_input(error),
        TimelineError::Thread(_) | TimelineError::Write { .. } => CommandError::failed(error),
    }
}

impl Drop for Oversight {
    fn drop(&mut self) {
        self.over.cancel();
    }
}
