//! Admission of connections before their handshake is complete.
//!
//! An unauthenticated peer must not keep workers out. So a new connection is always looked at, the number of pending ones is bounded for each host and in
//! all, and a connection that has sent nothing gives way to a new one. Connections of this machine have places of their own: the
//! master's own workers start undisturbed.

mod refusal_log;

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rayfarm_scheduler::HostId;
use tokio_util::sync::CancellationToken;

use crate::sessions::identity::host;

pub(crate) use refusal_log::RefusalLog;

/// Most connections in their handshake from other machines, and from this one.
const MAX_PENDING: usize = 64;
const MAX_PENDING_HERE: usize = 32;
/// Most connections in their handshake from one other host.
const MAX_PENDING_OF_HOST: usize = 8;
/// Time after which a connection that has sent something may give way as well: a handshake of a worker takes a part of that.
const SLOW: Duration = Duration::from_secs(1);

/// The connections in their handshake.
#[derive(Clone, Debug, Default)]
pub(crate) struct Admission(Arc<Mutex<Pending>>);

#[derive(Debug, Default)]
struct Pending {
    next: u64,
    /// In the order of their arrival.
    connections: BTreeMap<u64, Connection>,
}

#[derive(Debug)]
struct Connection {
    host: HostId,
    is_here: bool,
    since: Instant,
    has_sent: bool,
    /// Cancelled when the connection gives way.
    closed: CancellationToken,
}

/// The place of one connection in its handshake. Dropping it frees the place.
#[derive(Debug)]
pub(crate) struct Place {
    admission: Admission,
    number: u64,
    closed: CancellationToken,
}

impl Admission {
    /// A place for a connection from this address. `None`: there is none, and the connection is to be closed. An older connection may be
    /// closed for it.
    pub(crate) fn enter(&self, address: IpAddr) -> Option<Place> {
        self.enter_at(address, Instant::now())
    }

    fn enter_at(&self, address: IpAddr, now: Instant) -> Option<Place> {
        let (host, is_here) = (host(address), address.to_canonical().is_loopback());
        let mut pending = self.lock();
        if !is_here && pending.count(|other| other.host == host) >= MAX_PENDING_OF_HOST {
            pending.close_one(now, |other| other.host == host)?;
        }
        let limit = if is_here { MAX_PENDING_HERE } else { MAX_PENDING };
        if pending.count(|other| other.is_here == is_here) >= limit {
            pending.close_one(now, |other| other.is_here == is_here)?;
        }
        let (number, closed) = (pending.next, CancellationToken::new());
        pending.next += 1;
        let connection = Connection { host, is_here, since: now, has_sent: false, closed: closed.clone() };
        pending.connections.insert(number, connection);
        Some(Place { admission: self.clone(), number, closed })
    }

    /// Number of connections in their handshake.
    #[cfg(test)]
    fn pending(&self) -> usize {
        self.lock().connections.len()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Pending> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Pending {
    fn count(&self, which: impl Fn(&Connection) -> bool) -> usize {
        self.connections.values().filter(|connection| which(connection)).count()
    }

    /// Closes the oldest of these connections that has sent nothing, or else the oldest that is slow. `None` where there is neither.
    fn close_one(&mut self, now: Instant, which: impl Fn(&Connection) -> bool) -> Option<()> {
        let oldest = |can_go: &dyn Fn(&Connection) -> bool| {
            let mut fitting = self.connections.iter().filter(|(_, it)| which(it) && can_go(it));
            fitting.next().map(|(number, _)| *number)
        };
        let number =
            oldest(&|it| !it.has_sent).or_else(|| oldest(&|it| now.duration_since(it.since) >= SLOW))?;
        self.connections.remove(&number)?.closed.cancel();
        Some(())
    }
}

impl Place {
    /// Records that the connection has sent something.
    pub(crate) fn has_sent(&self) {
        if let Some(connection) = self.admission.lock().connections.get_mut(&self.number) {
            connection.has_sent = true;
        }
    }

    /// Waits until the connection has to give way to a newer one.
    pub(crate) async fn closed(&self) {
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
