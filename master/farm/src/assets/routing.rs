//! Who gets an asset from whom, so that the master's link carries a large one about once.
//!
//! Workers that want an asset make a chain: the first gets it from the master, each further one from the worker before
//! it, which passes chunks on as they come in. A chain is as fast as its slowest link and takes a chunk's time longer for
//! each worker; a tree would halve the speed at every fork. Whoever is let down by its source gets the rest from the master,
//! and that source is asked for nothing any more.
//!
//! Pure: time is passed in; the same questions in the same order get the same answers.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use rayfarm_protocol::AssetId;
use rayfarm_protocol::limits::{MAX_CHUNK_BYTES, SHELF_TIME};

use rayfarm_scheduler::WorkerId;

/// Assets up to this size are sent by the master: they take it less than to arrange anything else.
pub(crate) const LEAST_PASSED_BYTES: usize = MAX_CHUNK_BYTES;
/// Workers that get an asset from the same one at a time, where some workers pass nothing on.
const MAX_FOLLOWERS: usize = 2;

/// Where a worker gets an asset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// From the master.
    Master,
    /// From a worker that has it, or gets it now.
    Worker(WorkerId),
}

/// An asset at a worker.
#[derive(Clone, Copy, Debug)]
struct Copy {
    source: Source,
    /// Since when it is complete.
    complete: Option<Duration>,
}

/// All assets that workers have asked for in their sessions.
#[derive(Debug, Default)]
pub struct Chains {
    /// Workers that pass on, and have let nobody down.
    sharers: BTreeSet<WorkerId>,
    copies: BTreeMap<AssetId, BTreeMap<WorkerId, Copy>>,
}

impl Chains {
    /// A worker passes on what it gets.
    pub fn shares(&mut self, worker: WorkerId) {
        self.sharers.insert(worker);
    }

    /// A worker wants an asset, and can reach some of the others. `again`: it was let down by its source.
    pub fn wanted(
        &mut self,
        now: Duration,
        worker: WorkerId,
        id: AssetId,
        again: bool,
        reaches: impl Fn(WorkerId) -> bool,
    ) -> Source {
        let source = if again { self.let_down(worker, id) } else { self.best(now, worker, id, reaches) };
        self.copies.entry(id).or_default().insert(worker, Copy { source, complete: None });
        source
    }

    fn let_down(&mut self, worker: WorkerId, id: AssetId) -> Source {
        let copy = self.copies.get(&id).and_then(|copies| copies.get(&worker));
        if let Some(Copy { source: Source::Worker(source), .. }) = copy {
            self.sharers.remove(source);
        }
        Source::Master
    }

    fn best(
        &self,
        now: Duration,
        worker: WorkerId,
        id: AssetId,
        reaches: impl Fn(WorkerId) -> bool,
    ) -> Source {
        let Some(copies) = self.copies.get(&id) else { return Source::Master };
        let fresh = |copy: &Copy| copy.complete.is_none_or(|since| since + SHELF_TIME / 2 > now);
        let followers = |of: WorkerId| {
            let follows = |copy: &&Copy| copy.source == Source::Worker(of) && copy.complete.is_none();
            copies.values().filter(follows).count()
        };
        let able = copies.iter().filter(|&(&holder, copy)| {
            holder != worker && self.sharers.contains(&holder) && fresh(copy) && reaches(holder)
        });
        let counted = able.map(|(&holder, copy)| (followers(holder), copy.complete.is_none(), holder));
        let best = counted.filter(|(count, ..)| *count < MAX_FOLLOWERS).min();
        best.map_or(Source::Master, |(.., holder)| Source::Worker(holder))
    }

    /// A worker has got all of an asset.
    pub fn complete(&mut self, now: Duration, worker: WorkerId, id: AssetId) {
        if let Some(copy) = self.copies.get_mut(&id).and_then(|copies| copies.get_mut(&worker)) {
            copy.complete = Some(now);
        }
    }

    /// A session is over.
    pub fn left(&mut self, worker: WorkerId) {
        self.sharers.remove(&worker);
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

    fn sharing(count: u64) -> Chains {
        let mut chains = Chains::default();
        (1..=count).for_each(|worker| chains.shares(WorkerId(worker)));
        chains
    }

    fn wanted(chains: &mut Chains, worker: u64, again: bool) -> Source {
        chains.wanted(NOW, WorkerId(worker), ID, again, |_| true)
    }

    #[test]
    fn each_follows_the_one_before() {
        let mut chains = sharing(4);
        assert_eq!(wanted(&mut chains, 1, false), Source::Master);
        for worker in 2..=4 {
            assert_eq!(wanted(&mut chains, worker, false), Source::Worker(WorkerId(worker - 1)));
        }
        // Whoever has it whole and serves nobody goes before those who still get it.
        (1..=4).for_each(|worker| chains.complete(NOW, WorkerId(worker), ID));
        chains.shares(WorkerId(9));
        assert_eq!(wanted(&mut chains, 9, false), Source::Worker(WorkerId(1)));
    }

    #[test]
    fn who_lets_down_is_not_asked_again_and_the_master_gives_the_rest() {
        let mut chains = sharing(4);
        for worker in 1..=2 {
            wanted(&mut chains, worker, false);
        }
        assert_eq!(wanted(&mut chains, 2, true), Source::Master);
        assert_eq!(wanted(&mut chains, 3, false), Source::Worker(WorkerId(2)));
        chains.left(WorkerId(2));
        assert_eq!(wanted(&mut chains, 4, false), Source::Worker(WorkerId(3)));
        (1..=4).for_each(|worker| chains.left(WorkerId(worker)));
        assert!(chains.copies.is_empty() && chains.sharers.is_empty());
    }

    #[test]
    fn who_passes_nothing_on_is_passed_over() {
        let mut chains = sharing(1);
        let sources = [1, 2, 3, 4].map(|worker| wanted(&mut chains, worker, false));
        let first = Source::Worker(WorkerId(1));
        assert_eq!(sources, [Source::Master, first, first, Source::Master]);
    }

    #[test]
    fn what_is_not_ready_any_more_and_what_cannot_be_reached_is_not_asked_for() {
        let mut chains = sharing(2);
        wanted(&mut chains, 1, false);
        chains.complete(NOW, WorkerId(1), ID);
        let unreachable = chains.wanted(NOW, WorkerId(2), ID, false, |_| false);
        let too_late = chains.wanted(NOW + SHELF_TIME, WorkerId(2), ID, false, |_| true);
        assert_eq!([unreachable, too_late], [Source::Master; 2]);
    }
}
