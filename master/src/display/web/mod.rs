//! The web display: a server whose pages show the view, move its camera, and show and command the farm.
//!
//! ```text
//! connection (server) -> rules (access) -> routes -> page, /api, /metrics
//!                                             `-> WebSocket (socket) <-> messages, pictures, state, steering
//! ```
//!
//! Frames are encoded only for pages that can be seen, once for all of them. Without such a page, no frames are requested for this
//! display.

mod access;
mod audience;
mod commands;
mod message;
mod metrics;
mod pictures;
mod routes;
mod server;
mod shared;
mod socket;
mod status;
mod steering;
#[cfg(test)]
mod tests;

use std::net::{SocketAddr, TcpListener};
use std::time::Duration;

use rayfarm_farm::Reachable;
use rayfarm_protocol::transport::{BrowserAcceptor, JoinToken};

use self::access::Access;
use self::commands::Commands;
use self::shared::Shared;
use super::{Display, DisplayError, SceneInfo};
use crate::viewer::ViewerHandle;

pub(crate) use self::commands::CommandExecutor;

/// Time for encoders that run at the end.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(1);

/// Access to the pages, and encryption of their connections.
#[derive(Clone, Debug)]
pub(crate) struct WebSecurity {
    /// Token of owners.
    pub(crate) token: JoinToken,
    /// TLS with the master's key; `None` for plain connections.
    pub(crate) acceptor: Option<BrowserAcceptor>,
    /// Names of this machine, by which browsers may address it.
    pub(crate) names: Vec<String>,
}

/// A server for pages, which listens already.
pub(crate) struct WebDisplay {
    listener: TcpListener,
    address: SocketAddr,
    security: WebSecurity,
    info: SceneInfo,
}

/// A server for pages that can execute commands.
pub(crate) struct CommandedWebDisplay {
    display: WebDisplay,
    execute: CommandExecutor,
}

impl WebDisplay {
    /// Listens at an address.
    ///
    /// # Errors
    /// An address that is in use or not one of this machine, in words.
    pub(crate) fn open(address: SocketAddr, security: WebSecurity, info: SceneInfo) -> Result<Self, String> {
        let failed = |error: std::io::Error| {
            format!(
                "cannot listen at {address}: {error}; choose another address with --web ADDR:PORT, such as 127.0.0.1:0 for a free port"
            )
        };
        let listener = TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        Ok(Self { listener, address, security, info })
    }

    /// Executes the commands of pages with `execute`.
    pub(crate) fn with_commands(self, execute: CommandExecutor) -> CommandedWebDisplay {
        CommandedWebDisplay { display: self, execute }
    }

    fn access(&self) -> Access {
        let WebSecurity { token, acceptor, names } = &self.security;
        Access::new(*token, self.address, acceptor.is_some(), names)
    }
}

/// The addresses to open, best first, with the token.
fn urls(address: SocketAddr, access: &Access) -> Vec<String> {
    let addresses = Reachable::of(address).addresses.into_iter();
    addresses.map(|address| format!("{}://{address}{}", access.scheme(), access.entrance())).collect()
}

impl Display for CommandedWebDisplay {
    fn run(self, viewer: ViewerHandle) -> Result<(), DisplayError> {
        let Self { display, execute } = self;
        let failed =
            |error: std::io::Error| DisplayError::Failed(format!("the web display cannot run: {error}"));
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
        let result = runtime.block_on(serve(display, execute, viewer)).map_err(failed);
        runtime.shutdown_timeout(SHUTDOWN_TIMEOUT);
        result
    }
}

/// Serves pages until the viewer ends.
async fn serve(display: WebDisplay, execute: CommandExecutor, viewer: ViewerHandle) -> std::io::Result<()> {
    let access = display.access();
    for url in urls(display.address, &access) {
        tracing::info!("the view is at {url}");
    }
    let WebDisplay { listener, security, info, .. } = display;
    let listener = tokio::net::TcpListener::from_std(listener)?;
    let shared = Shared::new(viewer.clone(), access, Commands::new(execute), &info);
    let router = routes::router(shared.clone());
    tokio::select! {
        () = server::serve(listener, security.acceptor, router, viewer.ended()) => {}
        () = shared.audience.report(&viewer) => {}
        () = shared.publish() => {}
    }
    Ok(())
}
