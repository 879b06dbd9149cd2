//! Remote control of a run: commands, one per line, each answered by one line of JSON.
//!
//! They arrive on standard input (`--control -`), at a TCP port of this machine, or at a Unix socket with access for its user
//! only. All users of a machine, and web pages in their browsers, can reach its ports. There, the first line must be a token
//! from a file with access for the user only, and anything like HTTP ends the connection.

mod command;
mod console;
mod lines;
mod place;
mod slots;

mod socket;
#[cfg(unix)]
mod socket_file;
mod stdin;
mod token;

#[cfg(test)]
mod tests;

pub(crate) use console::Console;
pub(crate) use place::Place;

use tokio_util::sync::CancellationToken;

use crate::error::CommandError;

/// Accepts commands at a place until `stop` is cancelled. Must be called inside a runtime.
///
/// # Errors
/// A place at which the process cannot listen, with a remedy.
pub(crate) fn start(place: &Place, console: Console, stop: CancellationToken) -> Result<(), CommandError> {
    match place {
        Place::StandardInput => stdin::start(console),
        Place::Tcp(address) => socket::listen_tcp(*address, &token::folders(), console, stop),
        Place::Unix(path) => socket::listen_unix(path, console, stop),
    }
}
