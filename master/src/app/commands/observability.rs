//! What watches and steers a run: `--trace` and `--control`.

use tokio_util::sync::CancellationToken;

use crate::accounting::TraceFile;
use crate::app::cli::ObservabilityArgs;
use crate::app::control::{self, Console, Place};
use crate::app::error::CommandError;
use crate::farm::Farm;

/// As asked for on the command line.
pub(super) struct Observability {
    timeline: Option<TraceFile>,
    control: Option<Place>,
    /// Cancelled when the run is over.
    over: CancellationToken,
}

impl Observability {
    /// Creates the trace's file.
    ///
    /// # Errors
    /// A place that cannot be written.
    pub(super) fn new(args: &ObservabilityArgs) -> Result<Self, CommandError> {
        let timeline = args.timeline.as_deref().map(TraceFile::create).transpose()?;
        Ok(Self { timeline, control: args.control.clone(), over: CancellationToken::new() })
    }

    /// Watches a farm from now on, and takes commands for it; `quit` is cancelled where they end the run. Call it inside
    /// a runtime.
    ///
    /// # Errors
    /// A place that cannot be listened at.
    pub(super) fn begin(&self, farm: &Farm, quit: &CancellationToken) -> Result<(), CommandError> {
        if let Some(timeline) = &self.timeline {
            farm.trace_into(timeline.sink());
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
        self.timeline.take().map_or(Ok(()), TraceFile::finish)
    }
}

impl Drop for Observability {
    fn drop(&mut self) {
        self.over.cancel();
    }
}
