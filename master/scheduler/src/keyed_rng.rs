//! Random numbers from a secret key: uniform, reproducible with the key, unpredictable without it.

/// Generator whose n-th number is the BLAKE3 hash of n under the key.
#[derive(Debug, Default)]
pub(super) struct KeyedRng {
    key: [u8; 32],
    drawn: u64,
}

impl KeyedRng {
    pub(super) fn new(key: [u8; 32]) -> Self {
        Self { key, drawn: 0 }
    }

    /// The next number, uniform over all values.
    pub(super) fn next(&mut self) -> u64 {
        let hash = blake3::keyed_hash(&self.key, &self.drawn.to_le_bytes());
        self.drawn += 1;
        hash.as_bytes().first_chunk().copied().map_or(0, u64::from_le_bytes)
    }

    /// `true` with a probability of `percent` per cent.
    pub(super) fn chance(&mut self, percent: u8) -> bool {
        percent > 0 && self.next() % 100 < u64::from(percent)
    }

    /// A random index in proportion to the weights; `None` if they sum to 0.
    pub(super) fn pick_weighted(&mut self, weights: &[u64]) -> Option<usize> {
        let total = weights.iter().fold(0_u64, |sum, weight| sum.saturating_add(*weight));
        let mut left = self.next().checked_rem(total)?;
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
    fn numbers_depend_on_the_key_only() {
        let drawn = |key| {
            let mut rng = KeyedRng::new(key);
            [rng.next(), rng.next(), rng.next()]
        };
        assert_eq!(drawn([1; 32]), drawn([1; 32]));
        assert!(drawn([1; 32]).iter().all(|number| !drawn([2; 32]).contains(number)));
    }

    #[test]
    fn draws_are_uniform() {
        let mut rng = KeyedRng::new([3; 32]);
        let hits = (0..10_000).filter(|_| rng.chance(30)).count();
        assert!((2800..3200).contains(&hits), "{hits} of 10,000");
        assert!(!rng.chance(0) && rng.chance(100));
        let mut picked = [0; 3];
        (0..8000).for_each(|_| picked[rng.pick_weighted(&[1, 0, 3]).unwrap()] += 1);
        assert!(picked[1] == 0 && (1800..2200).contains(&picked[0]), "{picked:?}");
        assert_eq!((rng.pick_weighted(&[]), rng.pick_weighted(&[0])), (None, None));
    }
}
