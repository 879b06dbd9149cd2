//! Detection of a stalled transfer between workers.
//!
//! A transfer stalls when no chunk of any asset has arrived for a time: keepalives give no credit, and assets that wait for
//! others in the same chain are no reason to leave it. The time grows with the distance from the master, so that the worker
//! next to the stalled one requests the asset from the master first, and those behind it continue to receive from it.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

use rayfarm_protocol::limits::{MAX_PEER_HOPS, PEER_STALL_LIMIT, PEER_STALL_PER_HOP};
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};

/// Times of the chunks that arrive, and the distance from the master, of one session.
#[derive(Debug)]
pub(crate) struct StallClock {
    last_chunk: watch::Sender<Instant>,
    /// Number of workers between the master and this one, as the source reports it.
    hops: AtomicU64,
}

impl Default for StallClock {
    fn default() -> Self {
        Self { last_chunk: watch::Sender::new(Instant::now()), hops: AtomicU64::new(0) }
    }
}

impl StallClock {
    /// Records that a chunk of an asset has arrived.
    pub(crate) fn note_chunk(&self) {
        self.last_chunk.send_replace(Instant::now());
    }

    /// Records the distance that a waiting source reports.
    pub(super) fn note_hops(&self, hops: u64) {
        self.hops.store(hops.min(MAX_PEER_HOPS), Relaxed);
    }

    /// The distance that this worker reports to workers that wait for it.
    pub(super) fn hops_of_next(&self) -> u64 {
        (self.hops.load(Relaxed) + 1).min(MAX_PEER_HOPS)
    }

    /// Time without a chunk after which a transfer has stalled.
    pub(super) fn limit(&self) -> Duration {
        let hops = u32::try_from(self.hops.load(Relaxed)).unwrap_or(u32::MAX);
        PEER_STALL_LIMIT + PEER_STALL_PER_HOP.saturating_mul(hops)
    }

    /// Waits until a transfer that begins now has stalled. Cancel safe.
    pub(super) async fn stalled(&self) {
        let (begun, mut last) = (Instant::now(), self.last_chunk.subscribe());
        loop {
            let since = (*last.borrow_and_update()).max(begun);
            let limit = self.limit();
            tokio::select! {
                changed = last.changed() => if changed.is_err() { return },
                () = sleep_until(since + limit) => {
                    // The distance may have been reported meanwhile.
                    if since + self.limit() <= Instant::now() {
                        return;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn only_chunks_give_time_and_each_hop_gives_some() {
        let clock = Arc::new(StallClock::default());
        let begun = Instant::now();
        clock.stalled().await;
        assert_eq!(begun.elapsed(), PEER_STALL_LIMIT);

        clock.note_hops(4);
        let begun = Instant::now();
        let chunks = Arc::clone(&clock);
        tokio::spawn(async move {
            for _ in 0..5 {
                tokio::time::sleep(Duration::from_secs(2)).await;
                chunks.note_chunk();
            }
        });
        clock.stalled().await;
        let expected = Duration::from_secs(10) + PEER_STALL_LIMIT + 4 * PEER_STALL_PER_HOP;
        assert_eq!(begun.elapsed(), expected);
    }

    #[test]
    fn a_reported_distance_is_bounded() {
        let clock = StallClock::default();
        assert_eq!(clock.hops_of_next(), 1);
        clock.note_hops(u64::MAX);
        assert_eq!(clock.hops_of_next(), MAX_PEER_HOPS);
        assert!(clock.limit() <= Duration::from_secs(15), "{:?}", clock.limit());
    }
}
