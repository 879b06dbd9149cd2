//! Connections of other workers that have shown no valid token yet.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio_util::sync::CancellationToken;

/// Most connections without a valid token.
const MAX_PENDING: usize = 64;

/// The connections without a valid token, in the order in which they were accepted.
///
/// Above [`MAX_PENDING`] the oldest connection of the address with the most connections is closed, so that one address
/// does not keep others out.
#[derive(Clone, Debug, Default)]
pub(super) struct Pending {
    inner: Arc<Mutex<Inner>>,
}

#[derive(Debug, Default)]
struct Inner {
    next: u64,
    /// Addresses by the order of acceptance, with what closes their connections.
    places: BTreeMap<u64, (IpAddr, CancellationToken)>,
}

/// The place of one connection, until it is dropped.
#[derive(Debug)]
pub(super) struct Place {
    pending: Pending,
    number: u64,
    closed: CancellationToken,
}

impl Pending {
    /// Enters a connection, and closes another one where there are too many.
    pub(super) fn enter(&self, address: IpAddr) -> Place {
        let closed = CancellationToken::new();
        let mut inner = self.lock();
        let number = inner.next;
        inner.next += 1;
        inner.places.insert(number, (address.to_canonical(), closed.clone()));
        if inner.places.len() > MAX_PENDING {
            inner.close_one();
        }
        drop(inner);
        Place { pending: self.clone(), number, closed }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inner {
    /// Closes the oldest connection of the address with the most connections.
    fn close_one(&mut self) {
        let mut counts: BTreeMap<IpAddr, usize> = BTreeMap::new();
        self.places.values().for_each(|(address, _)| *counts.entry(*address).or_default() += 1);
        let most = counts.values().copied().max();
        let oldest = self.places.iter().find(|(_, (address, _))| counts.get(address).copied() == most);
        if let Some((&number, _)) = oldest
            && let Some((_, closed)) = self.places.remove(&number)
        {
            closed.cancel();
        }
    }
}

impl Place {
    /// Waits until the connection has to close.
    pub(super) async fn closed(&self) {
        self.closed.cancelled().await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.pending.lock().places.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_closed(place: &Place) -> bool {
        place.closed.is_cancelled()
    }

    #[test]
    fn an_address_with_many_connections_closes_its_own_oldest_one() {
        let (pending, one, many) =
            (Pending::default(), IpAddr::from([10, 0, 0, 1]), IpAddr::from([10, 0, 0, 2]));
        let first = pending.enter(one);
        let places: Vec<_> = (0..3 * MAX_PENDING).map(|_| pending.enter(many)).collect();
        assert!(!is_closed(&first), "another address keeps its place");
        let open = places.iter().filter(|place| !is_closed(place)).count();
        assert_eq!(open, MAX_PENDING - 1);
        assert!(places.iter().rev().take(open).all(|place| !is_closed(place)), "the newest are open");
        let newcomer = pending.enter(one);
        assert!(!is_closed(&newcomer) && !is_closed(&first));
    }

    #[test]
    fn a_dropped_place_is_free() {
        let (pending, address) = (Pending::default(), IpAddr::from([10, 0, 0, 1]));
        for _ in 0..3 * MAX_PENDING {
            assert!(!is_closed(&pending.enter(address)));
        }
        assert!(pending.lock().places.is_empty());
    }
}
