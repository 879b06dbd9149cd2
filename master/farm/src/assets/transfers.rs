//! Progress of asset transfers: what each worker has requested, and the bytes of it that were sent.

use std::collections::BTreeMap;

use rayfarm_protocol::AssetId;

/// The transfers of one session.
#[derive(Debug, Default)]
pub(crate) struct Transfers {
    /// For each asset in transfer its size and the bytes sent, in bytes.
    pending: BTreeMap<AssetId, (u64, u64)>,
    /// Size of the completed assets, in bytes.
    complete: u64,
}

/// Progress of the transfers to all workers that wait for a part of the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TransferStatus {
    /// Number of these workers.
    pub workers: u32,
    /// Bytes that they have received.
    pub done: u64,
    /// Bytes that they have requested.
    pub total: u64,
}

impl Transfers {
    /// Adds a request for an asset of `size` bytes from `offset` on.
    pub(crate) fn requested(&mut self, id: AssetId, size: u64, offset: u64) {
        self.pending.insert(id, (size, offset.min(size)));
    }

    /// Notes that all bytes of an asset up to `end` are sent.
    pub(crate) fn sent(&mut self, id: AssetId, end: u64) {
        let Some((size, done)) = self.pending.get_mut(&id) else { return };
        *done = end.min(*size);
        if *done == *size {
            self.complete(id);
        }
    }

    /// Notes that the worker has an asset, from any source.
    pub(crate) fn complete(&mut self, id: AssetId) {
        if let Some((size, _)) = self.pending.remove(&id) {
            self.complete += size;
        }
    }

    /// Drops the transfers of all assets but those that `is_kept` selects: their scenes are not shown any more.
    pub(crate) fn retain(&mut self, is_kept: impl Fn(AssetId) -> bool) {
        self.pending.retain(|id, _| is_kept(*id));
    }

    /// Adds this session to `status`, if it waits for anything.
    pub(crate) fn add_to(&self, status: &mut TransferStatus) {
        if self.pending.is_empty() {
            return;
        }
        status.workers += 1;
        let (total, done) =
            self.pending.values().fold((0, 0), |(total, done), (size, sent)| (total + size, done + sent));
        status.total += self.complete + total;
        status.done += self.complete + done;
    }
}

impl TransferStatus {
    /// A text for progress lines; `None` if no worker waits.
    pub fn to_text(&self) -> Option<String> {
        if self.workers == 0 || self.total == 0 {
            return None;
        }
        let percent = 100.0 * self.done as f64 / self.total as f64;
        let megabytes = self.total as f64 / 1e6;
        let whom =
            if self.workers == 1 { "1 worker".to_owned() } else { format!("{} workers", self.workers) };
        Some(format!("scene to {whom}: {percent:.0} % of {megabytes:.1} MB"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: AssetId = AssetId([1; 32]);
    const B: AssetId = AssetId([2; 32]);

    fn status(transfers: &[&Transfers]) -> TransferStatus {
        let mut status = TransferStatus::default();
        transfers.iter().for_each(|transfers| transfers.add_to(&mut status));
        status
    }

    #[test]
    fn bytes_are_counted_until_the_transfer_is_complete() {
        let (mut one, mut other) = (Transfers::default(), Transfers::default());
        assert_eq!(status(&[&one, &other]).to_text(), None);
        one.requested(A, 1_000_000, 0);
        one.requested(B, 3_000_000, 500_000);
        one.sent(A, 500_000);
        let half = TransferStatus { workers: 1, done: 1_000_000, total: 4_000_000 };
        assert_eq!(status(&[&one, &other]), half);
        assert_eq!(half.to_text().unwrap(), "scene to 1 worker: 25 % of 4.0 MB");
        one.sent(A, 1_000_000);
        assert_eq!(status(&[&one]), TransferStatus { done: 1_500_000, ..half });
        other.requested(A, 1_000_000, 0);
        assert_eq!(status(&[&one, &other]).to_text().unwrap(), "scene to 2 workers: 30 % of 5.0 MB");
        one.sent(B, u64::MAX);
        other.complete(A);
        assert_eq!(status(&[&one, &other]), TransferStatus::default());
        one.sent(B, 7);
        assert_eq!(status(&[&one]), TransferStatus::default());
    }
}
