//! Admission of connections before their peer is authenticated.
//!
//! An unauthenticated peer must not exclude others. Therefore the number of pending connections is bounded for each host
//! and in all, and a new connection replaces one that has sent nothing. Connections of this machine and of known hosts have
//! places of their own.

mod host;

use std::collections::{BTreeMap, BTreeSet};
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;

pub use host::host_number;

use crate::ProtocolError;
use crate::limits::FIRST_BYTE_DEADLINE;

/// Time after which a connection that has sent something may be replaced too. A handshake of a worker is shorter.
const SLOW: Duration = Duration::from_secs(1);
/// Most known hosts. Further ones have the places of unknown hosts.
const MAX_KNOWN: usize = 1024;

/// Most pending connections of each class of hosts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdmissionLimits {
    /// From unknown hosts.
    pub unknown: usize,
    /// From known hosts.
    pub known: usize,
    /// From this machine.
    pub here: usize,
    /// From one host, except for this machine.
    pub of_host: usize,
}

/// The pending connections of one listener.
#[derive(Clone, Debug)]
pub struct Admission {
    limits: AdmissionLimits,
    pending: Arc<Mutex<Pending>>,
}

#[derive(Debug, Default)]
struct Pending {
    next: u64,
    /// In the order of their arrival.
    connections: BTreeMap<u64, Connection>,
    known: BTreeSet<u128>,
    refused: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Class {
    Unknown,
    Known,
    Here,
}

#[derive(Debug)]
struct Connection {
    host: u128,
    class: Class,
    since: Instant,
    has_sent: bool,
    /// Cancelled when the connection gives way.
    closed: CancellationToken,
}

/// The place of one pending connection. Dropping it frees the place.
#[derive(Debug)]
pub struct Place {
    admission: Admission,
    number: u64,
    closed: CancellationToken,
}

impl Admission {
    /// No pending connections, and these limits.
    pub fn new(limits: AdmissionLimits) -> Self {
        Self { limits, pending: Arc::default() }
    }

    /// A place for a connection from this address. `None`: there is none, and the connection is to be closed. An older
    /// connection may be closed for it.
    pub fn enter(&self, address: IpAddr) -> Option<Place> {
        self.enter_at(address, Instant::now())
    }

    fn enter_at(&self, address: IpAddr, now: Instant) -> Option<Place> {
        let host = host_number(address);
        let mut pending = self.lock();
        let class = match address.to_canonical().is_loopback() {
            true => Class::Here,
            false if pending.known.contains(&host) => Class::Known,
            false => Class::Unknown,
        };
        let limit = match class {
            Class::Unknown => self.limits.unknown,
            Class::Known => self.limits.known,
            Class::Here => self.limits.here,
        };
        let of_host = |other: &Connection| other.host == host;
        let has_room = class == Class::Here || pending.make_room(now, self.limits.of_host, of_host);
        if !has_room || !pending.make_room(now, limit, |other| other.class == class) {
            pending.refused += 1;
            return None;
        }
        let (number, closed) = (pending.next, CancellationToken::new());
        pending.next += 1;
        let connection = Connection { host, class, since: now, has_sent: false, closed: closed.clone() };
        pending.connections.insert(number, connection);
        Some(Place { admission: self.clone(), number, closed })
    }

    /// Gives the host of an address the places of known hosts from now on.
    pub fn add_known(&self, address: IpAddr) {
        let mut pending = self.lock();
        if pending.known.len() < MAX_KNOWN {
            pending.known.insert(host_number(address));
        }
    }

    /// Number of pending connections.
    pub fn pending(&self) -> usize {
        self.lock().connections.len()
    }

    /// Number of connections that got no place or gave way, up to now.
    pub fn refused(&self) -> u64 {
        self.lock().refused
    }

    fn lock(&self) -> MutexGuard<'_, Pending> {
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Pending {
    /// Whether there are fewer than `limit` of these connections, or one of them could be closed.
    fn make_room(&mut self, now: Instant, limit: usize, which: impl Fn(&Connection) -> bool) -> bool {
        let count = self.connections.values().filter(|connection| which(connection)).count();
        count < limit || self.close_one(now, which)
    }

    /// Closes the oldest of these connections that has sent nothing, or else the oldest that is slow. Returns whether there was
    /// one.
    fn close_one(&mut self, now: Instant, which: impl Fn(&Connection) -> bool) -> bool {
        let oldest = |can_go: &dyn Fn(&Connection) -> bool| {
            let mut fitting = self.connections.iter().filter(|(_, it)| which(it) && can_go(it));
            fitting.next().map(|(number, _)| *number)
        };
        let number =
            oldest(&|it| !it.has_sent).or_else(|| oldest(&|it| now.duration_since(it.since) >= SLOW));
        let closed = number.and_then(|number| self.connections.remove(&number));
        closed.iter().for_each(|connection| connection.closed.cancel());
        self.refused += closed.iter().count() as u64;
        closed.is_some()
    }
}

impl Place {
    /// Records that the connection has sent something.
    pub fn has_sent(&self) {
        if let Some(connection) = self.admission.lock().connections.get_mut(&self.number) {
            connection.has_sent = true;
        }
    }

    /// Waits for the first byte of the connection and leaves it in the stream. Cancel safe.
    ///
    /// # Errors
    /// A connection that is closed, fails, or sends nothing within [`FIRST_BYTE_DEADLINE`].
    pub async fn wait_for_first_byte(&self, stream: &TcpStream) -> Result<(), ProtocolError> {
        let late = ProtocolError::Deadline { what: "sending its first byte", limit: FIRST_BYTE_DEADLINE };
        let first = timeout(FIRST_BYTE_DEADLINE, stream.peek(&mut [0])).await.map_err(|_| late)?;
        match first {
            Ok(0) => Err(ProtocolError::Closed { at: "before its first byte" }),
            Ok(_) => {
                self.has_sent();
                Ok(())
            }
            Err(source) => Err(ProtocolError::Io { doing: "waiting for the first byte", source }),
        }
    }

    /// Waits until the connection has to give way to a newer one. Cancel safe.
    pub async fn closed(&self) {
        self.closed.cancelled().await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.admission.lock().connections.remove(&self.number);
    }
}

#[cfg(test)]
mod tests;
