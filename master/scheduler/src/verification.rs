//! Verification: a sample of the finished segments is rendered a second time and compared.
//!
//! Segments are sampled with the secret key of the run when their pixels arrive, so that no worker can predict which
//! ones; the second renderer is drawn as well, see [`second`](super::second). Pictures do not wait: a segment enters its
//! picture at once. Its second rendering comes after the rows of the oldest frame and before those of the next frame.
//! Workers that are always busy would never reach it, so pending verifications of complete frames come first, one at a
//! time per worker. A verification that no worker has finished two complete frames later is dropped.
//!
//! The shell compares the two renderings: it keeps a digest of the first one. Where they differ, the arbiter renders the
//! rows on the master, and the master bans every worker whose result does not match. A vote among workers would
//! be cheaper and could be wrong: two machines with the same fault agree. Verifications that are drawn for the master,
//! or for which no other worker is ready, are arbitrated one at a time, by a random priority.
//!
//! Segments of untrusted workers are sampled by default, see [`trust`](super::trust), and rendered again by trusted
//! workers. Without a share to verify there is no arbiter, and the trusted worker's rendering decides.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::time::Duration;

use super::adaptive::Fleet;
use super::forecast::Load;
use super::keyed_rng::KeyedRng;
use super::limits::TRAILING_FRAMES;
use super::worker::Worker;
use super::{Action, FrameId, HostId, Lease, Scheduler, WorkerId};

/// Pending verifications at most; segments sampled beyond that are not verified.
pub(super) const MAX_PENDING: usize = 1024;
/// Pending verifications that wait for the master at most; those with the lowest priority numbers stay.
pub(super) const MAX_FOR_MASTER: usize = 8;
/// Banned workers that are remembered: pending verifications can accuse at most these.
pub(super) const MAX_BANNED: usize = 2 * MAX_PENDING;

/// Counts of verified segments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verification {
    /// The share of the segments to verify, in per cent.
    pub percent: u8,
    /// Segments that were sampled.
    pub picked: u64,
    /// Segments that were rendered twice and compared.
    pub verified: u64,
    /// Segments whose renderings differed.
    pub mismatches: u64,
    /// Segments whose verification is pending. `picked - verified - open` segments were dropped.
    pub open: u64,
}

/// Outcome of comparing the second rendering of a segment with the first one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// The bytes are equal.
    Same,
    /// The bytes differ.
    Different,
    /// The first rendering is no longer known.
    Unknown,
}

/// Renderings of a segment that differ from the master's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArbiterResult {
    /// Whether the master rendered the segment and knew the digest of the first rendering.
    pub rendered: bool,
    /// Whether the first rendering differs.
    pub first_differs: bool,
    /// Whether the second rendering differs; `false` if there is none.
    pub second_differs: bool,
}

/// A sampled segment whose verification is pending.
#[derive(Debug)]
pub(super) struct PendingVerification {
    /// Its rows, under a segment number of their own; the attempt is that of the next lease.
    pub(super) lease: Lease,
    load: Load,
    /// The worker that rendered the rows first.
    pub(super) first: Renderer,
    /// Order in the master's queue, lowest first.
    priority: u64,
    pub(super) stage: Stage,
}

/// A worker that has rendered a segment, and may have left since.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Renderer {
    pub(super) worker: WorkerId,
    /// Its machine.
    pub(super) host: HostId,
    /// Whether it is trusted.
    pub(super) trusted: bool,
}

/// Stage of a pending verification.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// Waits for this second renderer.
    Waiting(SecondRenderer),
    /// Leased to this worker.
    Leased(WorkerId),
    /// Rendered by the arbiter, because this worker's bytes differ, or (`None`) because the master was drawn.
    Arbitrating(Option<WorkerId>),
}

/// Renderer of a second rendering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SecondRenderer {
    /// A worker.
    Worker(WorkerId),
    /// The master itself.
    Master,
}

impl Stage {
    /// Whether the master ends the verification.
    pub(super) fn is_for_master(self) -> bool {
        matches!(self, Self::Arbitrating(_) | Self::Waiting(SecondRenderer::Master))
    }
}

/// All pending verifications.
#[derive(Debug, Default)]
pub(super) struct VerificationQueue {
    pub(super) counts: Verification,
    pub(super) rng: KeyedRng,
    pub(super) pending: BTreeMap<(FrameId, u32), PendingVerification>,
    /// The newest complete frames, oldest first.
    complete: VecDeque<FrameId>,
    /// Banned workers, oldest first, so that each is banned once.
    pub(super) banned: VecDeque<WorkerId>,
}

impl VerificationQueue {
    /// Draws whether a segment is verified, with this probability.
    fn samples(&mut self, percent: u8) -> bool {
        self.rng.chance(percent) && self.pending.len() < MAX_PENDING
    }

    /// Verifications that wait for the master.
    pub(super) fn waiting_for_master(&self) -> usize {
        let waits = |pending: &&PendingVerification| pending.stage == Stage::Waiting(SecondRenderer::Master);
        self.pending.values().filter(waits).count()
    }

    /// Whether the arbiter renders a segment that was drawn for the master.
    fn is_arbitrating_drawn(&self) -> bool {
        self.pending.values().any(|pending| pending.stage == Stage::Arbitrating(None))
    }

    /// The key of the verification with the lowest priority number, or the highest, of those that wait for the master.
    fn masters_next(&self, highest: bool) -> Option<(FrameId, u32)> {
        let waits = |pending: &PendingVerification| pending.stage == Stage::Waiting(SecondRenderer::Master);
        let waiting = self.pending.iter().filter(|(_, pending)| waits(pending));
        let priorities = waiting.map(|(&key, pending)| (pending.priority, key));
        let found = if highest { priorities.max() } else { priorities.min() };
        found.map(|(_, key)| key)
    }
}

impl Scheduler {
    /// Verifies `percent` of the segments; the default is 0. `secret` keys the draws of segments and second renderers:
    /// without it, a worker cannot predict them.
    #[must_use]
    pub fn with_verification(mut self, percent: u8, secret: [u8; 32]) -> Self {
        self.verifications.counts.percent = percent.min(100);
        self.verifications.rng = KeyedRng::new(secret);
        self
    }

    /// Counts of verified segments.
    pub fn verification(&self) -> Verification {
        Verification { open: self.verifications.pending.len() as u64, ..self.verifications.counts }
    }

    /// Samples row ranges of which a worker has delivered the first valid pixels.
    pub(super) fn sample_for_verification(&mut self, id: WorkerId, lease: &Lease, fresh: Vec<Range<u32>>) {
        let Some(worker) = self.workers.get(&id) else { return };
        let first = Renderer { worker: id, host: worker.host, trusted: worker.trusted };
        let percent = self.standings.percent(worker).max(self.verifications.counts.percent);
        for rows in fresh {
            if !self.verifications.samples(percent) {
                continue;
            }
            let Some(second) = self.draw_second_renderer(first, None) else { continue };
            let stage = Stage::Waiting(second);
            let priority = self.verifications.rng.next();
            let Some(frame) = self.frames.iter_mut().find(|frame| frame.id == lease.frame) else { return };
            let load = Load::of(&frame.forecast, rows.clone());
            let (first_row, row_count) = (rows.start, rows.end - rows.start);
            let lease = Lease { segment: frame.next_number(), attempt: 0, first_row, row_count, ..*lease };
            let pending = PendingVerification { lease, load, first, priority, stage };
            self.verifications.pending.insert((lease.frame, lease.segment), pending);
            self.verifications.counts.picked += 1;
            self.actions.push_back(Action::RecordDigest { worker: first.worker, lease });
        }
    }

    /// Leases a pending verification of a complete frame, if the worker verifies nothing yet.
    pub(super) fn lease_trailing_verification(
        &mut self,
        now: Duration,
        id: WorkerId,
        fleet: Option<&mut Fleet>,
    ) -> bool {
        let verifies = |worker: &Worker| worker.leases.values().any(|active| active.verifies);
        let Some(oldest) = self.frames.front().map(|frame| frame.id) else { return false };
        !self.workers.get(&id).is_none_or(verifies) && self.lease_verification_before(now, id, fleet, oldest)
    }

    /// Leases the oldest verification that waits for this worker, if there is one.
    pub(super) fn lease_verification(
        &mut self,
        now: Duration,
        id: WorkerId,
        fleet: Option<&mut Fleet>,
    ) -> bool {
        self.lease_verification_before(now, id, fleet, FrameId(u64::MAX))
    }

    fn lease_verification_before(
        &mut self,
        now: Duration,
        id: WorkerId,
        fleet: Option<&mut Fleet>,
        before: FrameId,
    ) -> bool {
        let waits =
            |pending: &&mut PendingVerification| pending.stage == Stage::Waiting(SecondRenderer::Worker(id));
        let oldest =
            self.verifications.pending.range_mut(..(before, 0)).map(|(_, pending)| pending).find(waits);
        let Some(pending) = oldest else { return false };
        pending.stage = Stage::Leased(id);
        let (lease, load) = (pending.lease, pending.load);
        pending.lease.attempt += 1;
        self.grant_verification(now, id, lease, fleet, load);
        true
    }

    /// Arbitrates the next segment that was drawn for the master, one at a time, and bounds how many of them wait.
    pub(super) fn arbitrate_next(&mut self) {
        if !self.verifications.is_arbitrating_drawn()
            && let Some(key) = self.verifications.masters_next(false)
            && let Some(pending) = self.verifications.pending.get_mut(&key)
        {
            pending.stage = Stage::Arbitrating(None);
            let Lease { frame, segment, .. } = pending.lease;
            self.actions.push_back(Action::Arbitrate { frame, segment });
        }
        while self.verifications.waiting_for_master() > MAX_FOR_MASTER
            && let Some(key) = self.verifications.masters_next(true)
        {
            self.close_verification(key);
        }
    }

    /// Requeues rows that have left their picture.
    pub(super) fn rows_rejected(&mut self, frame: FrameId, first_row: u32, row_count: u32) {
        let known = self.frames.iter_mut().find(|known| known.id == frame);
        let rows = first_row..first_row.saturating_add(row_count);
        for number in known.map(|known| known.reject(rows)).unwrap_or_default() {
            // Overdue leases of these rows are void: the rows get new leases.
            self.workers.values_mut().for_each(|worker| worker.drop_lease((frame, number)));
        }
    }

    /// Drops verifications that are too old, now that `frame` is complete. Those for the master stay: its delay must
    /// save no worker that has sent wrong pixels.
    pub(super) fn expire_verifications(&mut self, frame: FrameId) {
        self.verifications.complete.push_back(frame);
        if self.verifications.complete.len() > TRAILING_FRAMES {
            self.verifications.complete.pop_front();
        }
        let oldest = self.verifications.complete.front().copied().unwrap_or(frame);
        self.drop_verifications(|pending| pending.lease.frame < oldest && !pending.stage.is_for_master());
    }

    /// Moves verifications of a complete frame that a worker cannot render to the master.
    pub(super) fn fail_verifications(&mut self, id: WorkerId, frame: FrameId) {
        let leased = |pending: &PendingVerification| {
            pending.lease.frame == frame && pending.stage == Stage::Leased(id)
        };
        let failed = self.verifications.pending.iter_mut().filter(|(_, pending)| leased(pending));
        let to_master = |pending: &mut PendingVerification| {
            pending.stage = Stage::Waiting(SecondRenderer::Master);
        };
        let keys: Vec<_> = failed.map(|(&key, pending)| (to_master(pending), key).1).collect();
        keys.into_iter().for_each(|key| self.revoke_verification(Stage::Leased(id), key));
    }

    /// Drops pending verifications.
    pub(super) fn drop_verifications(&mut self, which: impl Fn(&PendingVerification) -> bool) {
        let keys =
            self.verifications.pending.iter().filter(|(_, pending)| which(pending)).map(|(&key, _)| key);
        keys.collect::<Vec<_>>().into_iter().for_each(|key| self.close_verification(key));
    }

    /// Ends a verification and its lease.
    pub(super) fn close_verification(&mut self, key: (FrameId, u32)) {
        let Some(pending) = self.verifications.pending.remove(&key) else { return };
        let (frame, segment) = key;
        self.actions.push_back(Action::DropDigest { frame, segment });
        self.revoke_verification(pending.stage, key);
    }

    /// Drops the lease of a second rendering that is not needed any more.
    pub(super) fn revoke_verification(&mut self, stage: Stage, key: (FrameId, u32)) {
        if let Stage::Leased(holder) = stage
            && let Some(worker) = self.workers.get_mut(&holder)
        {
            worker.drop_lease(key);
        }
    }
}
