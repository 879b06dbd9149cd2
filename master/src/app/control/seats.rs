//! The connections that are open: few, and none for ever.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

/// Connections at a time. When another one comes, the one that has been idle for longest gives way, those first that have
/// not shown the token.
pub(super) const MAX_CONNECTIONS: usize = 8;

/// All connections.
#[derive(Clone, Debug, Default)]
pub(super) struct Seats(Arc<Mutex<Inner>>);

#[derive(Debug, Default)]
struct Inner {
    seats: Vec<Seat>,
    last: u64,
}

#[derive(Debug)]
struct Seat {
    number: u64,
    is_trusted: bool,
    idle_since: Instant,
    give_way: CancellationToken,
}

/// The place of one connection; free again when it is dropped.
#[derive(Debug)]
pub(super) struct Connection {
    seats: Seats,
    number: u64,
    /// Cancelled when it has to give way.
    pub(super) give_way: CancellationToken,
}

impl Seats {
    /// A place for a new connection.
    pub(super) fn take(&self) -> Connection {
        let mut inner = self.lock();
        if inner.seats.len() >= MAX_CONNECTIONS {
            let key = |seat: &Seat| (seat.is_trusted, seat.idle_since);
            let idlest = inner.seats.iter().enumerate().min_by_key(|(_, seat)| key(seat)).map(|(at, _)| at);
            if let Some(at) = idlest {
                inner.seats.swap_remove(at).give_way.cancel();
            }
        }
        inner.last += 1;
        let (number, give_way) = (inner.last, CancellationToken::new());
        let (is_trusted, idle_since) = (false, Instant::now());
        inner.seats.push(Seat { number, is_trusted, idle_since, give_way: give_way.clone() });
        Connection { seats: self.clone(), number, give_way }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Connection {
    /// The connection has given a command, and may.
    pub(super) fn touch(&self) {
        let mut inner = self.seats.lock();
        if let Some(seat) = inner.seats.iter_mut().find(|seat| seat.number == self.number) {
            (seat.is_trusted, seat.idle_since) = (true, Instant::now());
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.seats.lock().seats.retain(|seat| seat.number != self.number);
    }
}
