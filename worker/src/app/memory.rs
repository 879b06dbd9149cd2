//! Split of a worker's memory bound among its caches and buffers.

use rayfarm_protocol::limits::{INBOX_BYTES, MAX_PEER_CACHE_BYTES, MAX_PIXELS_BYTES};

/// Segments that a worker holds at a time: the queue of the pixel sender (8), its buffers for reuse (16), and those in
/// progress, which are few because leases are rendered in order.
const HELD_SEGMENTS: u64 = 32;

/// Ratio of the memory of decoded and compiled assets, with the bytes from which they are decoded, to those bytes.
const DECODED_RATIO: u64 = 4;

/// Parts of the bound of `--memory`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MemoryBudget {
    /// Largest total size of the assets in memory, as their encoded bytes.
    pub(super) asset_bytes: u64,
    /// Largest pixels of one segment.
    pub(super) segment_bytes: usize,
    /// Whether assets for other workers fit as well.
    pub(super) allows_peers: bool,
}

impl MemoryBudget {
    /// Splits a bound: a quarter for pixels, an eighth or 64 MiB for received messages, the peer cache where it is at most a
    /// quarter, the rest for assets.
    pub(super) fn of_mib(mib: u64) -> Self {
        let total = mib << 20;
        let pixels = (total / 4).min(HELD_SEGMENTS * MAX_PIXELS_BYTES as u64);
        let allows_peers = MAX_PEER_CACHE_BYTES as u64 <= total / 4;
        let peers = if allows_peers { MAX_PEER_CACHE_BYTES as u64 } else { 0 };
        let rest = total.saturating_sub(pixels + peers + INBOX_BYTES as u64);
        let segment_bytes = usize::try_from(pixels / HELD_SEGMENTS).unwrap_or(MAX_PIXELS_BYTES);
        Self { asset_bytes: rest / DECODED_RATIO, segment_bytes, allows_peers }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_are_within_the_bound() {
        for mib in [256, 300, 1024, 2047, 2048, 16 << 10, 1 << 24] {
            let budget = MemoryBudget::of_mib(mib);
            let peers = if budget.allows_peers { MAX_PEER_CACHE_BYTES as u64 } else { 0 };
            let pixels = HELD_SEGMENTS * budget.segment_bytes as u64;
            let sum = budget.asset_bytes * DECODED_RATIO + pixels + peers + INBOX_BYTES as u64;
            assert!(sum <= mib << 20, "{mib} MiB: {budget:?}");
            // At least 16 rows of a picture with a width of 1920 pixels fit.
            assert!(budget.segment_bytes >= 16 * 1920 * 3 && budget.segment_bytes <= MAX_PIXELS_BYTES);
            assert!(budget.asset_bytes >= 16 << 20, "{mib} MiB: {budget:?}");
        }
        assert!(!MemoryBudget::of_mib(2047).allows_peers && MemoryBudget::of_mib(2048).allows_peers);
    }
}
