//! Option of `view` that selects its displays.

use clap::{Args, ValueEnum};

/// Displays of a view.
#[derive(Clone, Debug, Args)]
pub(crate) struct DisplayArgs {
    /// Displays, separated by commas; all show the same view. The first one decides the size of the picture.
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',', default_value = "window")]
    pub(crate) display: Vec<DisplayKind>,
}

/// Kind of a display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DisplayKind {
    /// A window on the screen of this machine.
    Window,
}
