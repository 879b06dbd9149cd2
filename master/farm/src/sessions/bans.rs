//! Banned workers, and workers that have disconnected lately and may still be banned.

use std::collections::VecDeque;

use rayfarm_scheduler::WorkerId;

use super::identity::Identity;

/// Banned workers that are remembered. Beyond that, the oldest ban is dropped.
const MAX_BANNED: usize = 1024;
/// Disconnected workers that are remembered.
const MAX_DISCONNECTED: usize = 256;

/// A worker that is banned or has disconnected.
#[derive(Clone, Debug)]
pub(crate) struct PastWorker {
    /// Its number in its last session.
    pub(crate) worker: WorkerId,
    pub(crate) identity: Identity,
}

/// The list of bans, with what is needed to ban a worker after its session has ended.
#[derive(Debug, Default)]
pub(crate) struct Bans {
    banned: VecDeque<PastWorker>,
    /// Wrong pixels may be found when their worker has disconnected already.
    disconnected: VecDeque<PastWorker>,
}

impl Bans {
    /// Bans an identity; `worker` is its last number.
    pub(crate) fn ban(&mut self, worker: WorkerId, identity: Identity) {
        if !self.is_banned(&identity) {
            push_bounded(&mut self.banned, PastWorker { worker, identity }, MAX_BANNED);
        }
    }

    /// Whether a worker is refused when it connects.
    pub(crate) fn is_banned(&self, identity: &Identity) -> bool {
        self.banned.iter().any(|banned| banned.identity == *identity)
    }

    /// Lifts the bans that `which` selects. Returns the identities.
    pub(crate) fn allow(&mut self, which: impl Fn(&PastWorker) -> bool) -> Vec<Identity> {
        let (allowed, banned) = std::mem::take(&mut self.banned).into_iter().partition::<Vec<_>, _>(which);
        self.banned = banned.into();
        allowed.into_iter().map(|worker| worker.identity).collect()
    }

    /// All banned workers, oldest ban first.
    pub(crate) fn banned(&self) -> impl Iterator<Item = &PastWorker> {
        self.banned.iter()
    }

    /// Records a worker whose session has ended.
    pub(crate) fn add_disconnected(&mut self, worker: WorkerId, identity: Identity) {
        push_bounded(&mut self.disconnected, PastWorker { worker, identity }, MAX_DISCONNECTED);
    }

    /// The identity of a worker that has disconnected lately.
    pub(crate) fn disconnected(&self, worker: WorkerId) -> Option<&Identity> {
        self.disconnected.iter().find(|past| past.worker == worker).map(|past| &past.identity)
    }
}

/// Appends to a queue of at most `bound` elements; the oldest are dropped.
fn push_bounded(queue: &mut VecDeque<PastWorker>, worker: PastWorker, bound: usize) {
    queue.push_back(worker);
    while queue.len() > bound {
        queue.pop_front();
    }
}
