//! Option of `view` that selects its displays.

use clap::{Args, ValueEnum};

/// Displays of a view.
#[derive(Clone, Debug, Args)]
pub(crate) struct DisplayArgs {
    /// Displays, separated by commas; all show the same view. The first one decides the size of the picture.
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',', default_value = "window")]
    pub(crate) display: Vec<DisplayKind>,
    /// How the terminal shows pictures; without it, the best way that the terminal reports.
    #[cfg(feature = "terminal")]
    #[arg(long, value_name = "KIND", value_enum)]
    pub(crate) cells: Option<Cells>,
}

/// Kind of a display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DisplayKind {
    /// A window on the screen of this machine.
    Window,
    /// The terminal of this process, also over ssh.
    #[cfg(feature = "terminal")]
    Terminal,
}

/// Way in which the terminal shows pictures.
#[cfg(feature = "terminal")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Cells {
    /// Characters of 1 x 2 pixels; in every font.
    Half,
    /// Characters of 2 x 2 pixels.
    Quadrant,
    /// Characters of 2 x 3 pixels (Unicode 13).
    Sextant,
    /// Characters of 2 x 4 pixels (Unicode 16).
    Octant,
    /// Pictures in the protocol of kitty.
    Kitty,
    /// Pictures in the protocol of iTerm2.
    Iterm,
    /// Pictures as sixels.
    Sixel,
}
