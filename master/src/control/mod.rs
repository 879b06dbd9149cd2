//! Steering a run from outside: commands, one a line, each answered by one line of JSON.
//!
//! They come from standard input (`--control -`), from a TCP port of this machine, or from a Unix socket. Whoever can
//! reach the place may give commands: there is no password, so TCP is confined to loopback addresses, and a Unix
//! socket belongs to its user alone.

mod command;
mod console;
mod lines;
mod place;
mod socket;
mod stdin;

#[cfg(test)]
mod tests;

pub(crate) use console::{Console, KICKED};
pub(crate) use place::Place;

use tokio_util::sync::CancellationToken;

use crate::error::CommandError;

/// Takes commands at a place until `stop`. Call it inside a runtime.
///
/// # Errors
/// A place that cannot be listened at, and what to do about it.
pub(crate) fn start(place: &Place, console: Console, stop: CancellationToken) -> Result<(), CommandError> {
    match place {
        Place::StandardInput => stdin::start(console),
        Place::Tcp(address) => socket::listen_tcp(*address, console, stop),
        Place::Unix(path) => socket::listen_unix(path, console, stop),
    }
}
