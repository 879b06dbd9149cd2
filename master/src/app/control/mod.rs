//! Steering a run from outside: commands, one a line, each answered by one line of JSON.
//!
//! They come from standard input (`--control -`), from a TCP port of this machine, or from a Unix socket, which belongs to
//! its user alone. All users of a machine, and web pages in their browsers, can reach its ports: there, the first
//! line is a token from a file that belongs to the user alone, and what looks like HTTP ends the connection.

mod command;
mod console;
mod lines;
mod place;
mod seats;
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

use crate::app::error::CommandError;

/// Takes commands at a place until `stop`. Call it inside a runtime.
///
/// # Errors
/// A place that cannot be listened at, and what to do about it.
pub(crate) fn start(place: &Place, console: Console, stop: CancellationToken) -> Result<(), CommandError> {
    match place {
        Place::StandardInput => stdin::start(console),
        Place::Tcp(address) => socket::listen_tcp(*address, &token::folders(), console, stop),
        Place::Unix(path) => socket::listen_unix(path, console, stop),
    }
}
