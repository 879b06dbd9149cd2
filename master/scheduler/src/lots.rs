//! Chance from a secret: even, the same for the same secret, and unknown to all who do not have it.

/// Draws numbers, each the keyed hash of how many were drawn before.
#[derive(Debug, Default)]
pub(super) struct Lots {
    key: [u8; 32],
    drawn: u64,
}

impl Lots {
    pub(super) fn new(key: [u8; 32]) -> Self {
        Self { key, drawn: 0 }
    }

    /// The next number, any with the same chance.
    pub(super) fn draw(&mut self) -> u64 {
        let hash = blake3::keyed_hash(&self.key, &self.drawn.to_le_bytes());
        self.drawn += 1;
        hash.as_bytes().first_chunk().copied().map_or(0, u64::from_le_bytes)
    }

    /// Whether something happens that has this chance, in per cent.
    pub(super) fn hits(&mut self, percent: u8) -> bool {
        percent > 0 && self.draw() % 100 < u64::from(percent)
    }

    /// One of several, in proportion to their weights; the index of it.
    pub(super) fn pick(&mut self, weights: &[u64]) -> Option<usize> {
        let total = weights.iter().fold(0_u64, |sum, weight| sum.saturating_add(*weight));
        let mut left = self.draw().checked_rem(total)?;
        weights.iter().position(|weight| {
            let here = left < *weight;
            left = left.saturating_sub(*weight);
            here
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_follow_from_the_key_alone() {
        let drawn = |key| {
            let mut lots = Lots::new(key);
            [lots.draw(), lots.draw(), lots.draw()]
        };
        assert_eq!(drawn([1; 32]), drawn([1; 32]));
        assert!(drawn([1; 32]).iter().all(|lot| !drawn([2; 32]).contains(lot)));
    }

    #[test]
    fn draws_are_even() {
        let mut lots = Lots::new([3; 32]);
        let hits = (0..10_000).filter(|_| lots.hits(30)).count();
        assert!((2800..3200).contains(&hits), "{hits} of 10,000");
        assert!(!lots.hits(0) && lots.hits(100));
        let mut picked = [0; 3];
        (0..8000).for_each(|_| picked[lots.pick(&[1, 0, 3]).unwrap()] += 1);
        assert!(picked[1] == 0 && (1800..2200).contains(&picked[0]), "{picked:?}");
        assert_eq!((lots.pick(&[]), lots.pick(&[0])), (None, None));
    }
}
