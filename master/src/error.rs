//! Errors of commands, and the exit status of each.

use std::process::ExitCode;

use crate::display::DisplayError;
use crate::viewer::{FrameLogError, ViewerError};

/// Reason for which a command failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CommandError {
    /// The command line, or a file that it names, is wrong: exit status 2.
    #[error("{0}")]
    WrongInput(String),
    /// Any other failure: exit status 1.
    #[error("{0}")]
    Failed(String),
    /// Ctrl-C or SIGTERM; the text says how much was finished: exit status 1.
    #[error("interrupted: {0}")]
    Interrupted(String),
}

impl CommandError {
    /// A wrong command line or a wrong file.
    pub(crate) fn wrong_input(error: impl std::fmt::Display) -> Self {
        Self::WrongInput(error.to_string())
    }

    /// A failure that the input did not cause.
    pub(crate) fn failed(error: impl std::fmt::Display) -> Self {
        Self::Failed(error.to_string())
    }

    /// The exit status of the process.
    pub(crate) fn exit_code(&self) -> ExitCode {
        match self {
            Self::WrongInput(_) => ExitCode::from(2),
            Self::Failed(_) | Self::Interrupted(_) => ExitCode::from(1),
        }
    }
}

impl From<ViewerError> for CommandError {
    fn from(error: ViewerError) -> Self {
        match error {
            ViewerError::Farm(error) => Self::failed(error),
            ViewerError::Log(error) => error.into(),
        }
    }
}

impl From<FrameLogError> for CommandError {
    fn from(error: FrameLogError) -> Self {
        match error {
            FrameLogError::Create { .. } => Self::wrong_input(error),
            FrameLogError::Write { .. } => Self::failed(error),
        }
    }
}

impl From<DisplayError> for CommandError {
    fn from(error: DisplayError) -> Self {
        match error {
            DisplayError::Failed(problem) => Self::Failed(problem),
            DisplayError::Interrupted => Self::Interrupted(String::new()),
        }
    }
}
