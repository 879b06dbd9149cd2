//! Asset routing: which worker fetches an asset from which, so that the master's link carries a large one about once.
//!
//! Workers that request an asset form a chain (chain replication): the first fetches it from the master, each further one
//! from its predecessor, which forwards chunks as they arrive. A chain is as fast as its slowest link and adds the time of
//! one chunk for each worker; a tree would halve the rate at every fork. A worker whose source fails fetches the rest from
//! the master, and that source serves no further workers.
//!
//! Pure: time is passed in, and the same calls in the same order give the same results.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use rayfarm_protocol::AssetId;
use rayfarm_protocol::limits::{MAX_CHUNK_BYTES, PEER_CACHE_TIME};
use rayfarm_scheduler::WorkerId;

/// Size up to which the master sends an asset itself: sending one chunk costs less than arranging a transfer.
pub(crate) const MAX_DIRECT_BYTES: usize = MAX_CHUNK_BYTES;
/// Workers that fetch an asset from the same worker at a time. Above 1 it continues a chain past workers without a peer
/// server.
const MAX_PEER_CLIENTS: usize = 2;

/// Longest time until a worker that has requested the rest of an asset from the master, and its followers, receive bytes again.
const RESUME_TIME: Duration = Duration::from_secs(5);

/// The source from which a worker fetches an asset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssetSource {
    /// The master.
    Master,
    /// A worker that has the asset or is fetching it.
    Worker(WorkerId),
}

/// A worker's copy of an asset.
#[derive(Clone, Copy, Debug)]
struct Copy {
    source: AssetSource,
    /// Time at which the worker requested the asset from the master because its source had failed.
    resumed: Option<Duration>,
    /// Time at which the asset became complete; `None` while it is in transfer.
    complete: Option<Duration>,
}

/// The copies of all assets, and the workers that serve them.
#[derive(Debug, Default)]
pub struct AssetRouting {
    /// Workers with a peer server that has not failed.
    peers: BTreeSet<WorkerId>,
    copies: BTreeMap<AssetId, BTreeMap<WorkerId, Copy>>,
}

impl AssetRouting {
    /// Adds a worker that serves its assets to others.
    pub fn add_peer_server(&mut self, worker: WorkerId) {
        self.peers.insert(worker);
    }

    /// Chooses the source of an asset for a worker that can reach the workers selected by `reaches`. `again`: its previous
    /// source has failed.
    pub fn route(
        &mut self,
        now: Duration,
        worker: WorkerId,
        id: AssetId,
        again: bool,
        reaches: impl Fn(WorkerId) -> bool,
    ) -> AssetSource {
        let source =
            if again { self.drop_source(now, worker, id) } else { self.best(now, worker, id, reaches) };
        self.copies
            .entry(id)
            .or_default()
            .insert(worker, Copy { source, resumed: again.then_some(now), complete: None });
        source
    }

    /// Removes the source that has failed for a worker from the peers.
    fn drop_source(&mut self, now: Duration, worker: WorkerId, id: AssetId) -> AssetSource {
        if let Some(failed) = self.failed_source(now, worker, id) {
            self.peers.remove(&failed);
        }
        AssetSource::Master
    }

    /// The failed source of a worker. `None` for a source that has just requested the asset from the master, because the
    /// source's own source had failed. The stall limit grows with the distance from the master, so the direct follower of the
    /// failed worker reports first.
    fn failed_source(&self, now: Duration, worker: WorkerId, id: AssetId) -> Option<WorkerId> {
        let copies = self.copies.get(&id)?;
        let AssetSource::Worker(source) = copies.get(&worker)?.source else { return None };
        let resumes = |copy: &Copy| {
            copy.complete.is_none() && copy.resumed.is_some_and(|at| now.saturating_sub(at) < RESUME_TIME)
        };
        (!copies.get(&source).is_some_and(resumes)).then_some(source)
    }

    /// The reachable peer with the fewest followers; of equals a complete copy, then the lowest number.
    fn best(
        &self,
        now: Duration,
        worker: WorkerId,
        id: AssetId,
        reaches: impl Fn(WorkerId) -> bool,
    ) -> AssetSource {
        let Some(copies) = self.copies.get(&id) else { return AssetSource::Master };
        let fresh = |copy: &Copy| copy.complete.is_none_or(|since| since + PEER_CACHE_TIME / 2 > now);
        let followers = |of: WorkerId| {
            let follows = |copy: &&Copy| copy.source == AssetSource::Worker(of) && copy.complete.is_none();
            copies.values().filter(follows).count()
        };
        let able = copies.iter().filter(|&(&holder, copy)| {
            holder != worker && self.peers.contains(&holder) && fresh(copy) && reaches(holder)
        });
        let counted = able.map(|(&holder, copy)| (followers(holder), copy.complete.is_none(), holder));
        let best = counted.filter(|(count, ..)| *count < MAX_PEER_CLIENTS).min();
        best.map_or(AssetSource::Master, |(.., holder)| AssetSource::Worker(holder))
    }

    /// Marks a worker's copy as complete.
    pub fn complete(&mut self, now: Duration, worker: WorkerId, id: AssetId) {
        if let Some(copy) = self.copies.get_mut(&id).and_then(|copies| copies.get_mut(&worker)) {
            copy.complete = Some(now);
        }
    }

    /// Removes the copies of all assets but those that `is_kept` selects.
    pub fn retain(&mut self, is_kept: impl Fn(AssetId) -> bool) {
        self.copies.retain(|id, _| is_kept(*id));
    }

    /// Removes a worker whose session has ended, with its copies.
    pub fn remove_worker(&mut self, worker: WorkerId) {
        self.peers.remove(&worker);
        self.copies.retain(|_, copies| {
            copies.remove(&worker);
            !copies.is_empty()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: AssetId = AssetId([7; 32]);
    const NOW: Duration = Duration::from_secs(1);

    fn with_peers(count: u64) -> AssetRouting {
        let mut routing = AssetRouting::default();
        (1..=count).for_each(|worker| routing.add_peer_server(WorkerId(worker)));
        routing
    }

    fn route(routing: &mut AssetRouting, worker: u64, again: bool) -> AssetSource {
        routing.route(NOW, WorkerId(worker), ID, again, |_| true)
    }

    #[test]
    fn workers_form_a_chain() {
        let mut routing = with_peers(4);
        assert_eq!(route(&mut routing, 1, false), AssetSource::Master);
        for worker in 2..=4 {
            assert_eq!(route(&mut routing, worker, false), AssetSource::Worker(WorkerId(worker - 1)));
        }
        // A complete copy without followers is preferred to one in transfer.
        (1..=4).for_each(|worker| routing.complete(NOW, WorkerId(worker), ID));
        routing.add_peer_server(WorkerId(9));
        assert_eq!(route(&mut routing, 9, false), AssetSource::Worker(WorkerId(1)));
    }

    #[test]
    fn a_peer_that_fails_is_not_used_again_and_the_master_sends_the_rest() {
        let mut routing = with_peers(4);
        for worker in 1..=2 {
            route(&mut routing, worker, false);
        }
        assert_eq!(route(&mut routing, 2, true), AssetSource::Master);
        assert_eq!(route(&mut routing, 3, false), AssetSource::Worker(WorkerId(2)));
        routing.remove_worker(WorkerId(2));
        assert_eq!(route(&mut routing, 4, false), AssetSource::Worker(WorkerId(3)));
        (1..=4).for_each(|worker| routing.remove_worker(WorkerId(worker)));
        assert!(routing.copies.is_empty() && routing.peers.is_empty());
    }

    #[test]
    fn a_worker_whose_own_source_has_failed_is_not_at_fault() {
        let mut routing = with_peers(5);
        for worker in 1..=3 {
            route(&mut routing, worker, false);
        }
        // Worker 1 stalls: worker 2 reports it, and worker 3 reports worker 2 soon after.
        let report = |routing: &mut AssetRouting, worker: u64, at: Duration| {
            routing.route(at, WorkerId(worker), ID, true, |_| true)
        };
        report(&mut routing, 2, NOW);
        report(&mut routing, 3, NOW + Duration::from_millis(500));
        assert_eq!(routing.peers, [2, 3, 4, 5].map(WorkerId).into());
        // Worker 4 follows worker 2, which keeps its bytes: it is at fault when its time to resume is over.
        assert_eq!(route(&mut routing, 4, false), AssetSource::Worker(WorkerId(2)));
        report(&mut routing, 4, NOW + RESUME_TIME);
        assert_eq!(routing.peers, [3, 4, 5].map(WorkerId).into());
    }

    #[test]
    fn workers_without_a_peer_server_are_not_sources() {
        let mut routing = with_peers(1);
        let sources = [1, 2, 3, 4].map(|worker| route(&mut routing, worker, false));
        let first = AssetSource::Worker(WorkerId(1));
        assert_eq!(sources, [AssetSource::Master, first, first, AssetSource::Master]);
    }

    #[test]
    fn unreachable_peers_and_expired_copies_are_not_sources() {
        let mut routing = with_peers(2);
        route(&mut routing, 1, false);
        routing.complete(NOW, WorkerId(1), ID);
        let unreachable = routing.route(NOW, WorkerId(2), ID, false, |_| false);
        let too_late = routing.route(NOW + PEER_CACHE_TIME, WorkerId(2), ID, false, |_| true);
        assert_eq!([unreachable, too_late], [AssetSource::Master; 2]);
    }
}
