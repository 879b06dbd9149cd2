//! Rays and bytes of frames.

use serde::Serialize;

/// Rays of one frame by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct RaysPerFrame {
    /// Camera rays.
    pub(crate) primary: u64,
    /// Shadow rays.
    pub(crate) shadow: u64,
    /// Reflected and transmitted rays.
    pub(crate) secondary: u64,
}

impl RaysPerFrame {
    /// Mean of a total over `frames` frames, to the nearest ray.
    pub(crate) fn mean(self, frames: u32) -> Self {
        let mean = |total| mean(total, frames);
        Self { primary: mean(self.primary), shadow: mean(self.shadow), secondary: mean(self.secondary) }
    }

    /// Adds the rays of another frame. Saturates: the counts are claims of workers.
    pub(crate) fn add(&mut self, other: Self) {
        self.primary = self.primary.saturating_add(other.primary);
        self.shadow = self.shadow.saturating_add(other.shadow);
        self.secondary = self.secondary.saturating_add(other.secondary);
    }

    /// Rays of all kinds.
    pub(crate) fn total(self) -> u64 {
        self.primary.saturating_add(self.shadow).saturating_add(self.secondary)
    }
}

/// Bytes on the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct BytesPerFrame {
    /// Bytes that the master sent.
    pub(crate) sent: u64,
    /// Bytes that the master received.
    pub(crate) received: u64,
}

impl BytesPerFrame {
    /// Adds the bytes of another frame. Saturates.
    pub(crate) fn add(&mut self, other: Self) {
        self.sent = self.sent.saturating_add(other.sent);
        self.received = self.received.saturating_add(other.received);
    }
}

/// `total / count`, rounded to the nearest.
pub(crate) fn mean(total: u64, count: u32) -> u64 {
    let count = u64::from(count.max(1));
    total / count + u64::from(total % count >= count.div_ceil(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_round_to_the_nearest() {
        assert_eq!([mean(10, 4), mean(9, 4), mean(0, 4), mean(7, 0)], [3, 2, 0, 7]);
    }

    #[test]
    fn sums_and_means_of_claims_of_any_size_saturate() {
        let claim = RaysPerFrame { primary: u64::MAX, shadow: u64::MAX - 1, secondary: 3 };
        let mut sum = claim;
        sum.add(claim);
        assert_eq!(sum, RaysPerFrame { primary: u64::MAX, shadow: u64::MAX, secondary: 6 });
        assert_eq!(sum.mean(2).primary, u64::MAX / 2 + 1);
        assert_eq!((sum.mean(1).shadow, sum.mean(u32::MAX).secondary, sum.total()), (u64::MAX, 0, u64::MAX));
        let mut bytes = BytesPerFrame { sent: u64::MAX, received: 1 };
        bytes.add(bytes);
        assert_eq!(bytes, BytesPerFrame { sent: u64::MAX, received: 2 });
    }
}
