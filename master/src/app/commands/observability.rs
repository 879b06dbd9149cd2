//! Timeline and control of a run: `--timeline` and `--control`.

use rayfarm_farm::Farm;
use rayfarm_farm::accounting::{TimelineError, TimelineFile};
use tokio_util::sync::CancellationToken;

use crate::app::cli::ObservabilityArgs;
use crate::app::control::{self, Console, Place};
use crate::error::CommandError;
use crate::viewer::KnobSender;
use crate::viewer::edits::EditorHandle;

/// Timeline and control, as the command line requests them.
pub(super) struct Observability {
    timeline: Option<TimelineFile>,
    control: Option<Place>,
    /// Cancelled at the end of the run.
    over: CancellationToken,
}

impl Observability {
    /// Creates the file of the timeline.
    ///
    /// # Errors
    /// A file that cannot be created.
    pub(super) fn new(args: &ObservabilityArgs) -> Result<Self, CommandError> {
        let create = |path| TimelineFile::create(path, args.record_bytes());
        let timeline = args.timeline.as_deref().map(create).transpose().map_err(command_error)?;
        Ok(Self { timeline, control: args.control.clone(), over: CancellationToken::new() })
    }

    /// Records the timeline of a farm from now on, and accepts commands for it, for the knobs of `view` and for its scene. The command
    /// `quit` cancels `quit`. Must be called inside a runtime.
    ///
    /// # Errors
    /// A place at which the process cannot listen.
    pub(super) fn begin(
        &self,
        farm: &Farm,
        view: Option<(KnobSender, Option<EditorHandle>)>,
        quit: &CancellationToken,
    ) -> Result<(), CommandError> {
        if let Some(timeline) = &self.timeline {
            farm.record_timeline(timeline.sink());
        }
        match &self.control {
            Some(place) => {
                let (view, editor) = view.map_or((None, None), |(view, editor)| (Some(view), editor));
                let console = Console::new(farm.control(), view, quit.clone()).with_editor(editor);
                control::start(place, console, self.over.clone())
            }
            None => Ok(()),
        }
    }

    /// Ends control and timeline, and writes the rest of the timeline.
    ///
    /// # Errors
    /// A timeline that cannot be written.
    pub(super) fn end(&mut self) -> Result<(), CommandError> {
        self.over.cancel();
        self.timeline.take().map_or(Ok(()), |timeline| timeline.finish().map_err(command_error))
    }
}

/// A path that cannot be written is wrong input. A full disk is a failure.
fn command_error(error: TimelineError) -> CommandError {
    match error {
        TimelineError::Create { .. } | TimelineError::NotSeekable { .. } => CommandError::wrong_input(error),
        TimelineError::Thread(_) | TimelineError::Write { .. } => CommandError::failed(error),
    }
}

impl Drop for Observability {
    fn drop(&mut self) {
        self.over.cancel();
    }
}
