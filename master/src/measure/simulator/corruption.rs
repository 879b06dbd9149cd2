//! Simulated workers that send wrong pixels.

use rayfarm_scheduler::{Lease, WorkerId};

use super::setup::Corruption;
use super::world::World;

impl World {
    /// The error value of the pixels that a worker sends for a lease: 0 where they are right.
    pub(super) fn content(&mut self, id: WorkerId, lease: &Lease) -> u64 {
        let Some(corruption) = self.shell.corrupt.get(&id).copied() else { return 0 };
        let verifies = self.shell.first_rendering(lease);
        let is_wrong = match (corruption, verifies) {
            (Corruption::Random, _) | (Corruption::Colluding, None) => self.rng.one_in(2),
            (Corruption::Predicting, None) => !self.expects_sampling(lease),
            (Corruption::Predicting, Some(_)) => false,
            (Corruption::Colluding, Some((first, sent))) => {
                let colludes = self.shell.corrupt.get(&first) == Some(&Corruption::Colluding);
                return if colludes { sent } else { 0 };
            }
        };
        if is_wrong { 1 + self.rng.below(1 << 32) } else { 0 }
    }

    /// Whether a master with the corrupt worker's own key would verify a segment.
    fn expects_sampling(&self, lease: &Lease) -> bool {
        let place = [lease.frame.0.to_le_bytes(), u64::from(lease.segment).to_le_bytes()].concat();
        let hash = blake3::keyed_hash(&[0x11; 32], &place);
        hash.as_bytes().first_chunk().copied().map_or(0, u64::from_le_bytes) % 100
            < u64::from(self.setup.verify_percent)
    }
}
