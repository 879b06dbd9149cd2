//! Verifying what workers send: a share of the finished segments is rendered again, and compared.
//!
//! Which segments are verified is drawn with a secret of the run when their pixels are here, so no worker can know it
//! while it renders; by whom is drawn as well, see [`second`](super::second). The pictures do not
//! wait: a segment is in its picture at once. Its *audit* comes after the rows of the oldest frame and before those of the
//! next one. Where workers are always busy that would never be, so what is left over from frames that are complete comes
//! first, one audit at a time for each worker. An audit that a worker has not ended two complete frames later is given up.
//!
//! Whether two renderings are the same is the shell's to say: it keeps a hash of the first one. Where they differ, the
//! master traces the rows itself, and whoever sent others is expelled. A majority of workers would be cheaper to ask, and
//! could be wrong: two machines with the same fault agree. What was drawn for the master, or has no other worker, it traces
//! one segment at a time, as far as it gets, in an order that follows from the secret too.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::time::Duration;

use super::adaptive::Crew;
use super::assign::Load;
use super::lots::Lots;
use super::second::{MAX_FOR_MASTER, Second};
use super::worker::Worker;
use super::{Action, Cost, FrameId, HostId, Lease, Scheduler, WorkerId};

/// Audits that are open at a time; what would be picked beyond that is not.
pub(super) const MAX_AUDITS: usize = 1024;
/// Expelled workers that are remembered: no more can be accused by audits that are still open.
const MAX_EXPELLED: usize = 2 * MAX_AUDITS;
/// Complete frames of which audits may still be open.
pub(super) const TRAILING_FRAMES: usize = 2;

/// How many segments were verified.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verification {
    /// The share of the segments that is to be verified, in per cent.
    pub percent: u8,
    /// Segments that were picked.
    pub picked: u64,
    /// Those that were rendered twice and compared.
    pub verified: u64,
    /// Those of which the two differed.
    pub mismatches: u64,
    /// Those whose audit is not over. What is missing between these and those picked was given up.
    pub open: u64,
}

/// What a comparison has shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// Both have sent the same bytes.
    Same,
    /// They have not.
    Different,
    /// There is nothing any more to compare with.
    Unknown,
}

/// Who has sent other bytes than the master traces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verdict {
    /// Whether there was something to compare with.
    pub traced: bool,
    /// Whoever rendered the segment for the picture.
    pub painter: bool,
    /// Whoever rendered it again, if anybody did.
    pub checker: bool,
}

/// A segment that is verified.
#[derive(Debug)]
pub(super) struct Audit {
    /// Its rows, under a number of their own; the attempt is that of the next lease.
    pub(super) lease: Lease,
    load: Load,
    /// Who rendered them for the picture, and where.
    pub(super) painter: WorkerId,
    pub(super) host: HostId,
    /// Its place in the master's queue: the lowest comes first.
    lot: u64,
    pub(super) stage: Stage,
}

/// How far an audit is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// This one has to render it again.
    Waiting(Second),
    /// This worker does.
    Leased(WorkerId),
    /// The master does, because this worker's bytes differ, or because it was drawn.
    Judged(Option<WorkerId>),
}

impl Stage {
    /// Whether the audit is the master's to end.
    pub(super) fn is_masters(self) -> bool {
        matches!(self, Self::Judged(_) | Self::Waiting(Second::Master))
    }
}

/// All audits.
#[derive(Debug, Default)]
pub(super) struct Audits {
    pub(super) counts: Verification,
    pub(super) lots: Lots,
    pub(super) open: BTreeMap<(FrameId, u32), Audit>,
    /// The newest complete frames, oldest first.
    complete: VecDeque<FrameId>,
    /// Who was expelled, the oldest first: once is enough.
    expelled: VecDeque<WorkerId>,
}

impl Audits {
    /// Whether a segment is to be verified.
    fn picks(&mut self) -> bool {
        self.lots.hits(self.counts.percent) && self.open.len() < MAX_AUDITS
    }

    /// Audits that are the master's, and of which none has begun.
    pub(super) fn waiting_for_master(&self) -> usize {
        self.open.values().filter(|audit| audit.stage == Stage::Waiting(Second::Master)).count()
    }

    fn is_judging_alone(&self) -> bool {
        self.open.values().any(|audit| audit.stage == Stage::Judged(None))
    }

    /// The key of the audit with the lowest lot, or the highest, of those that wait for the master.
    fn of_master(&self, highest: bool) -> Option<(FrameId, u32)> {
        let waiting = self.open.iter().filter(|(_, audit)| audit.stage == Stage::Waiting(Second::Master));
        let lots = waiting.map(|(&key, audit)| (audit.lot, key));
        let found = if highest { lots.max() } else { lots.min() };
        found.map(|(_, key)| key)
    }
}

impl Scheduler {
    /// Verifies that percentage of the segments; none unless this is called. Which ones, and by whom, follows from
    /// `secret`: a worker that does not know it cannot tell.
    #[must_use]
    pub fn with_verification(mut self, percent: u8, secret: [u8; 32]) -> Self {
        self.audits.counts.percent = percent.min(100);
        self.audits.lots = Lots::new(secret);
        self
    }

    /// How many segments were verified.
    pub fn verification(&self) -> Verification {
        Verification { open: self.audits.open.len() as u64, ..self.audits.counts }
    }

    /// A worker has rendered rows for the picture, each of these runs as the first: perhaps some are to be verified.
    pub(super) fn pick(&mut self, painter: WorkerId, lease: &Lease, fresh: Vec<Range<u32>>) {
        let Some(host) = self.workers.get(&painter).map(|worker| worker.host) else { return };
        for rows in fresh {
            if !self.audits.picks() {
                continue;
            }
            let stage = Stage::Waiting(self.draw_second(painter, host, None));
            let lot = self.audits.lots.draw();
            let Some(frame) = self.frames.iter_mut().find(|frame| frame.id == lease.frame) else { return };
            let load = Load::of(&frame.forecast, rows.clone());
            let (first_row, row_count) = (rows.start, rows.end - rows.start);
            let lease = Lease { segment: frame.next_number(), attempt: 0, first_row, row_count, ..*lease };
            let audit = Audit { lease, load, painter, host, lot, stage };
            self.audits.open.insert((lease.frame, lease.segment), audit);
            self.audits.counts.picked += 1;
            self.actions.push_back(Action::Seal { worker: painter, lease });
        }
    }

    /// Leases what is left to verify of frames that are complete, if the worker verifies nothing yet.
    pub(super) fn give_old_audit(&mut self, now: Duration, id: WorkerId, crew: Option<&mut Crew>) -> bool {
        let verifies = |worker: &Worker| worker.leases.values().any(|held| held.audit);
        let Some(oldest) = self.frames.front().map(|frame| frame.id) else { return false };
        !self.workers.get(&id).is_none_or(verifies) && self.give_audit_before(now, id, crew, oldest)
    }

    /// Leases the oldest segment that this worker can verify, if there is one.
    pub(super) fn give_audit(&mut self, now: Duration, id: WorkerId, crew: Option<&mut Crew>) -> bool {
        self.give_audit_before(now, id, crew, FrameId(u64::MAX))
    }

    fn give_audit_before(
        &mut self,
        now: Duration,
        id: WorkerId,
        crew: Option<&mut Crew>,
        before: FrameId,
    ) -> bool {
        let its = |audit: &&mut Audit| audit.stage == Stage::Waiting(Second::Worker(id));
        let some = self.audits.open.range_mut(..(before, 0)).map(|(_, audit)| audit).find(its);
        let Some(audit) = some else { return false };
        audit.stage = Stage::Leased(id);
        let (lease, load) = (audit.lease, audit.load);
        audit.lease.attempt += 1;
        self.grant_audit(now, id, lease, crew, load);
        true
    }

    /// Has the master trace the next segment that is its own to verify, one at a time, and bounds how many of them wait.
    pub(super) fn judge_next(&mut self) {
        if !self.audits.is_judging_alone()
            && let Some(key) = self.audits.of_master(false)
            && let Some(audit) = self.audits.open.get_mut(&key)
        {
            audit.stage = Stage::Judged(None);
            self.actions.push_back(Action::Judge { frame: audit.lease.frame, segment: audit.lease.segment });
        }
        while self.audits.waiting_for_master() > MAX_FOR_MASTER
            && let Some(key) = self.audits.of_master(true)
        {
            self.close_audit(key);
        }
    }

    /// A segment was rendered again.
    pub(super) fn verified(
        &mut self,
        now: Duration,
        id: WorkerId,
        lease: Lease,
        cost: Cost,
        finding: Finding,
    ) {
        let key = (lease.frame, lease.segment);
        let was_held = self.finish(now, id, lease, cost).is_some();
        let open = self.audits.open.get_mut(&key).filter(|audit| !matches!(audit.stage, Stage::Judged(_)));
        let Some(audit) = open.filter(|_| was_held) else { return };
        match finding {
            Finding::Different => {
                let before = std::mem::replace(&mut audit.stage, Stage::Judged(Some(id)));
                let (frame, segment) = key;
                self.actions.push_back(Action::Judge { frame, segment });
                self.take_audit(before, key);
            }
            Finding::Same | Finding::Unknown => {
                self.audits.counts.verified += u64::from(finding == Finding::Same);
                self.close_audit(key);
            }
        }
    }

    /// The master has traced a segment itself.
    pub(super) fn judged(&mut self, frame: FrameId, segment: u32, verdict: Verdict) {
        let audit = self.audits.open.get(&(frame, segment));
        let Some(&Audit { lease, painter, stage: Stage::Judged(checker), .. }) = audit else { return };
        self.audits.counts.verified += u64::from(verdict.traced);
        self.audits.counts.mismatches += u64::from(checker.is_some() || verdict.painter);
        self.close_audit((frame, segment));
        let Lease { first_row, row_count, .. } = lease;
        let accused = [Some(painter).filter(|_| verdict.painter), checker.filter(|_| verdict.checker)];
        for worker in accused.into_iter().flatten() {
            if self.audits.expelled.contains(&worker) {
                continue;
            }
            self.audits.expelled.push_back(worker);
            if self.audits.expelled.len() > MAX_EXPELLED {
                self.audits.expelled.pop_front();
            }
            let reason = format!(
                "it has sent wrong pixels: of frame {frame}, rows {first_row}+{row_count}, the master traces others"
            );
            self.lose(worker);
            self.forget_audits(|audit| audit.painter == worker);
            self.actions.push_back(Action::Expel { worker, reason });
        }
    }

    /// Rows that are in no picture any more are rendered again, by others.
    pub(super) fn rejected(&mut self, frame: FrameId, first_row: u32, row_count: u32) {
        let known = self.frames.iter_mut().find(|known| known.id == frame);
        let rows = first_row..first_row.saturating_add(row_count);
        for number in known.map(|known| known.reject(rows)).unwrap_or_default() {
            // Somebody may be at them in vain: they have new leases now.
            self.workers.values_mut().for_each(|worker| worker.drop_lease((frame, number)));
        }
    }

    /// A frame is complete: audits of frames that are too old by now are given up. The master's are not: how long it takes
    /// must save no worker that has sent wrong pixels.
    pub(super) fn outlive_audits(&mut self, frame: FrameId) {
        self.audits.complete.push_back(frame);
        if self.audits.complete.len() > TRAILING_FRAMES {
            self.audits.complete.pop_front();
        }
        let oldest = self.audits.complete.front().copied().unwrap_or(frame);
        self.forget_audits(|audit| audit.lease.frame < oldest && !audit.stage.is_masters());
    }

    /// A worker says that it cannot render a frame which is complete: what it was to verify of it, the master does.
    pub(super) fn fail_audits(&mut self, id: WorkerId, frame: FrameId) {
        let its = self
            .audits
            .open
            .iter_mut()
            .filter(|(_, audit)| audit.lease.frame == frame && audit.stage == Stage::Leased(id));
        let keys: Vec<_> =
            its.map(|(&key, audit)| (audit.stage = Stage::Waiting(Second::Master), key).1).collect();
        keys.into_iter().for_each(|key| self.take_audit(Stage::Leased(id), key));
    }

    /// Gives up audits.
    pub(super) fn forget_audits(&mut self, which: impl Fn(&Audit) -> bool) {
        let keys = self.audits.open.iter().filter(|(_, audit)| which(audit)).map(|(&key, _)| key);
        keys.collect::<Vec<_>>().into_iter().for_each(|key| self.close_audit(key));
    }

    /// Ends an audit.
    fn close_audit(&mut self, key: (FrameId, u32)) {
        let Some(audit) = self.audits.open.remove(&key) else { return };
        let (frame, segment) = key;
        self.actions.push_back(Action::Unseal { frame, segment });
        self.take_audit(audit.stage, key);
    }

    /// Whoever holds a lease of an audit that needs no answer any more has it taken off.
    fn take_audit(&mut self, stage: Stage, key: (FrameId, u32)) {
        if let Stage::Leased(holder) = stage
            && let Some(worker) = self.workers.get_mut(&holder)
        {
            worker.drop_lease(key);
        }
    }
}
