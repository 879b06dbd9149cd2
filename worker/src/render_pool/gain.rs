//! What compression has gained in a frame so far.

use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of a frame that are compressed before the gain counts.
const TRIAL_BYTES: u64 = 128 << 10;

/// Least share of the bytes that compression must save, as a divisor: 1/32.
const LEAST_SHARE: u64 = 32;

/// Bytes that were compressed in a frame, and those that this has saved. Light of few samples is noise, which LZ4 leaves as large as
/// it is: after the first bands of such a frame, no more are compressed. A lease with such bands is sent uncompressed.
#[derive(Debug, Default)]
pub(crate) struct Gain {
    tried: AtomicU64,
    saved: AtomicU64,
}

impl Gain {
    /// Whether the next band is worth compressing.
    pub(super) fn is_worthwhile(&self) -> bool {
        let (tried, saved) = (self.tried.load(Ordering::Relaxed), self.saved.load(Ordering::Relaxed));
        tried < TRIAL_BYTES || saved >= tried / LEAST_SHARE
    }

    /// Records a compressed band.
    pub(super) fn add(&self, raw: usize, packed: usize) {
        self.tried.fetch_add(raw as u64, Ordering::Relaxed);
        self.saved.fetch_add(raw.saturating_sub(packed) as u64, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compression_ends_in_a_frame_of_noise_and_goes_on_in_others() {
        let (noise, flat) = (Gain::default(), Gain::default());
        for _ in 0..100 {
            assert!(flat.is_worthwhile());
            flat.add(30_000, 20_000);
        }
        let tried =
            (0..100).take_while(|_| noise.is_worthwhile()).inspect(|_| noise.add(30_000, 30_008)).count();
        assert_eq!(tried, 5, "the first 128 KiB");
    }
}
