//! How a command ends when it does not end well, and the exit status that says so.

use std::process::ExitCode;

/// Why a command did not do what was asked.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CommandError {
    /// The command line, or a file it names, is wrong: exit status 2.
    #[error("{0}")]
    WrongInput(String),
    /// Anything else: exit status 1.
    #[error("{0}")]
    Failed(String),
    /// Ctrl-C or SIGTERM; the text says what was finished before it: exit status 1.
    #[error("interrupted: {0}")]
    Interrupted(String),
}

impl CommandError {
    /// A wrong command line or a wrong file.
    pub(crate) fn wrong_input(error: impl std::fmt::Display) -> Self {
        Self::WrongInput(error.to_string())
    }

    /// Anything that is not the caller's fault.
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
