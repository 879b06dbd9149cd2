//! The peer server of a worker, with the generation of the key of its tokens.
//!
//! Pure: time is passed in.

use std::net::SocketAddr;
use std::time::Duration;

use rayfarm_protocol::peer::ShareKey;
use rayfarm_scheduler::WorkerId;

/// Interval at which each peer server gets a new key. A token is valid for one to two intervals.
pub(crate) const KEY_INTERVAL: Duration = Duration::from_secs(300);

/// Time after a renewal in which tokens are made of the previous key, because the peer server may not have the new one yet.
const KEY_GRACE: Duration = Duration::from_secs(10);

/// First port at which a worker may serve assets: lower ones belong to services of the system.
const FIRST_PORT: u16 = 1024;

/// Address of a worker's peer server, and the generation of its key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PeerEndpoint {
    pub(crate) address: SocketAddr,
    generation: u64,
    /// Time of the last renewal.
    renewed_at: Duration,
}

impl PeerEndpoint {
    /// A peer server that is announced at the time `now`. `last`: what the worker announced before in this session, whose
    /// tokens end. Returns `None` for a port at which no worker serves.
    pub(crate) fn new(address: SocketAddr, last: Option<Self>, now: Duration) -> Option<Self> {
        let generation = last.map_or(0, |last| last.generation.saturating_add(1));
        (address.port() >= FIRST_PORT).then_some(Self { address, generation, renewed_at: now })
    }

    /// The generation of the newest key.
    pub(crate) fn generation(&self) -> u64 {
        self.generation
    }

    /// Begins the next generation.
    pub(crate) fn renew(&mut self, now: Duration) {
        self.generation = self.generation.saturating_add(1);
        self.renewed_at = now;
    }

    /// The generation of the key of which tokens are made at the time `now`.
    pub(crate) fn token_generation(&self, now: Duration) -> u64 {
        let is_new = now.saturating_sub(self.renewed_at) < KEY_GRACE;
        if is_new { self.generation.saturating_sub(1) } else { self.generation }
    }
}

/// The key of one generation of a worker's tokens, made of a secret of this master.
pub(crate) fn share_key(secret: &[u8; 32], worker: WorkerId, generation: u64) -> ShareKey {
    let mut hasher = blake3::Hasher::new_keyed(secret);
    hasher.update(b"share key of worker ").update(&worker.0.to_le_bytes());
    ShareKey(hasher.update(&generation.to_le_bytes()).finalize().into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(port: u16) -> SocketAddr {
        SocketAddr::from(([10, 0, 0, 7], port))
    }

    #[test]
    fn tokens_are_of_the_previous_key_until_the_new_one_has_arrived() {
        let start = Duration::from_secs(1000);
        let mut endpoint = PeerEndpoint::new(address(7200), None, start).unwrap();
        // There is no key before the first.
        assert_eq!((endpoint.generation(), endpoint.token_generation(start)), (0, 0));
        endpoint.renew(start + KEY_INTERVAL);
        assert_eq!(endpoint.generation(), 1);
        assert_eq!(endpoint.token_generation(start + KEY_INTERVAL), 0);
        assert_eq!(endpoint.token_generation(start + KEY_INTERVAL + KEY_GRACE), 1);
        assert_eq!(endpoint.token_generation(start + 2 * KEY_INTERVAL), 1);
    }

    #[test]
    fn each_worker_and_each_generation_has_a_key_of_its_own() {
        let key = |secret, worker, generation| share_key(&[secret; 32], WorkerId(worker), generation);
        let first = key(1, 1, 0);
        assert!(first == key(1, 1, 0));
        assert!([key(2, 1, 0), key(1, 2, 0), key(1, 1, 1), key(1, 0, 1)].iter().all(|other| *other != first));
    }

    #[test]
    fn a_server_that_is_announced_again_gets_another_key_and_ports_of_services_are_refused() {
        let first = PeerEndpoint::new(address(1024), None, Duration::ZERO).unwrap();
        let second = PeerEndpoint::new(address(1025), Some(first), Duration::ZERO).unwrap();
        assert_eq!((second.generation(), second.address.port()), (1, 1025));
        for port in [0, 22, 1023] {
            assert_eq!(PeerEndpoint::new(address(port), None, Duration::ZERO), None);
        }
    }
}
