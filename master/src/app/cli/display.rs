//! Options of `view` that select its displays.

#[cfg(feature = "web")]
use std::net::{Ipv4Addr, SocketAddr};

use clap::{Args, ValueEnum};

/// Displays of a view.
#[derive(Clone, Debug, Args)]
pub(crate) struct DisplayArgs {
    /// Displays, separated by commas; all show the same view. The first one decides the size of the picture [default: window, or
    /// web with --web].
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',')]
    display: Vec<DisplayKind>,
    /// Show the view in web browsers too, at this address [default: 127.0.0.1:8080 with --display web]. The log names the address to
    /// open, with its token. Beyond this machine the page uses TLS, unless --insecure turns it off.
    #[cfg(feature = "web")]
    #[arg(long, value_name = "ADDR:PORT", value_parser = super::values::listen_address)]
    web: Option<SocketAddr>,
    /// How the terminal shows pictures; without it, the best way that the terminal reports.
    #[cfg(feature = "terminal")]
    #[arg(long, value_name = "KIND", value_enum)]
    pub(crate) cells: Option<Cells>,
}

impl DisplayArgs {
    /// The displays, first one first, each once.
    pub(crate) fn kinds(&self) -> Vec<DisplayKind> {
        let mut kinds: Vec<DisplayKind> = Vec::new();
        let further = self.further();
        for kind in self.display.iter().chain(&further) {
            if !kinds.contains(kind) {
                kinds.push(*kind);
            }
        }
        if kinds.is_empty() {
            kinds.push(DisplayKind::Window);
        }
        kinds
    }

    /// The display that another option requests.
    #[cfg(feature = "web")]
    fn further(&self) -> Option<DisplayKind> {
        self.web.map(|_| DisplayKind::Web)
    }

    #[cfg(not(feature = "web"))]
    fn further(&self) -> Option<DisplayKind> {
        None
    }

    /// Address of the web display.
    #[cfg(feature = "web")]
    pub(crate) fn web_address(&self) -> SocketAddr {
        self.web.unwrap_or(SocketAddr::from((Ipv4Addr::LOCALHOST, DEFAULT_WEB_PORT)))
    }
}

/// Port of the web display without `--web`.
#[cfg(feature = "web")]
const DEFAULT_WEB_PORT: u16 = 8080;

/// Kind of a display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DisplayKind {
    /// A window on the screen of this machine.
    Window,
    /// The terminal of this process, also over ssh.
    #[cfg(feature = "terminal")]
    Terminal,
    /// Web browsers.
    #[cfg(feature = "web")]
    Web,
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
