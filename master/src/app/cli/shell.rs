//! The options of `completions` and `man`.

use std::path::PathBuf;

use clap::{Args, CommandFactory, ValueEnum};
use clap_complete::Shell;

use super::Cli;

/// `completions`.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell that reads the script.
    pub(crate) shell: Shell,
    /// The program whose options are completed.
    #[arg(long, value_enum, value_name = "PROGRAM", default_value_t)]
    pub(crate) program: Program,
}

/// `man`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ManArgs {
    /// The folder for the pages; it is created where it is missing.
    pub(crate) folder: PathBuf,
}

/// A program of the project.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Program {
    /// rayfarm-master
    #[default]
    Master,
    /// rayfarm-worker
    Worker,
}

impl Program {
    /// The definition of its command line.
    pub(crate) fn command_line(self) -> clap::Command {
        match self {
            Self::Master => Cli::command(),
            Self::Worker => rayfarm_worker::cli::command_line(),
        }
    }
}
