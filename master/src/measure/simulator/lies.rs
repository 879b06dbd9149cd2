//! Workers that send wrong pixels, and how they go about it.

use super::world::World;
use crate::scheduler::{Lease, WorkerId};

/// When a worker lies, and how it hides that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lie {
    /// Half of what it sends is wrong, by chance.
    #[default]
    Half,
    /// It knows how segments are drawn, and has another secret: it lies where that one would not look, and never when it
    /// renders a segment the second time.
    Knowing,
    /// The same, in half of its segments, and it confirms whatever another of its kind has sent.
    Accomplice,
}

impl World {
    /// What a worker sends for a lease: 0 where the pixels are the right ones.
    pub(super) fn content(&mut self, id: WorkerId, lease: &Lease) -> u64 {
        let Some(lie) = self.shell.liars.get(&id).copied() else { return 0 };
        let verifies = self.shell.sealed_by(lease);
        let lies = match (lie, verifies) {
            (Lie::Half, _) | (Lie::Accomplice, None) => self.dice.one_in(2),
            (Lie::Knowing, None) => !self.guess(lease),
            (Lie::Knowing, Some(_)) => false,
            (Lie::Accomplice, Some((first, sent))) => {
                let is_friend = self.shell.liars.get(&first) == Some(&Lie::Accomplice);
                return if is_friend { sent } else { 0 };
            }
        };
        if lies { 1 + self.dice.roll(1 << 32) } else { 0 }
    }

    /// Whether a master with the liar's own secret would verify a segment.
    fn guess(&self, lease: &Lease) -> bool {
        let place = [lease.frame.0.to_le_bytes(), u64::from(lease.segment).to_le_bytes()].concat();
        let hash = blake3::keyed_hash(&[0x11; 32], &place);
        hash.as_bytes().first_chunk().copied().map_or(0, u64::from_le_bytes) % 100
            < u64::from(self.setup.verify_percent)
    }
}
