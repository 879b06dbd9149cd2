//! Slots of open connections: few, and reused when idle.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

/// Largest number of connections. A further one replaces the one that has been idle for longest, first of those that have not
/// sent the token.
pub(super) const MAX_CONNECTIONS: usize = 8;

/// Slots of all connections.
#[derive(Clone, Debug, Default)]
pub(super) struct ConnectionSlots(Arc<Mutex<Inner>>);

#[derive(Debug, Default)]
struct Inner {
    slots: Vec<Slot>,
    last: u64,
}

#[derive(Debug)]
struct Slot {
    number: u64,
    /// Whether the connection has sent the token.
    is_trusted: bool,
    idle_since: Instant,
    replaced: CancellationToken,
}

/// Slot of one connection; free again when it is dropped.
#[derive(Debug)]
pub(super) struct Connection {
    slots: ConnectionSlots,
    number: u64,
    /// Cancelled when another connection replaces this one.
    pub(super) replaced: CancellationToken,
}

impl ConnectionSlots {
    /// Takes a slot for a new connection.
    pub(super) fn take(&self) -> Connection {
        let mut inner = self.lock();
        if inner.slots.len() >= MAX_CONNECTIONS {
            let key = |slot: &Slot| (slot.is_trusted, slot.idle_since);
            let idlest = inner.slots.iter().enumerate().min_by_key(|(_, slot)| key(slot)).map(|(at, _)| at);
            if let Some(at) = idlest {
                inner.slots.swap_remove(at).replaced.cancel();
            }
        }
        inner.last += 1;
        let (number, replaced) = (inner.last, CancellationToken::new());
        let (is_trusted, idle_since) = (false, Instant::now());
        inner.slots.push(Slot { number, is_trusted, idle_since, replaced: replaced.clone() });
        Connection { slots: self.clone(), number, replaced }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Connection {
    /// Records a command of a connection that has sent the token.
    pub(super) fn touch(&self) {
        let mut inner = self.slots.lock();
        if let Some(slot) = inner.slots.iter_mut().find(|slot| slot.number == self.number) {
            (slot.is_trusted, slot.idle_since) = (true, Instant::now());
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.slots.lock().slots.retain(|slot| slot.number != self.number);
    }
}
