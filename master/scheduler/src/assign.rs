//! Assignment: which worker gets rows, and in which order. The policy decides how many.

use std::collections::VecDeque;
use std::time::Duration;

use super::active_lease::ActiveLease;
use super::adaptive::Fleet;
use super::forecast::Load;
use super::frame::Frame;
use super::limits::FIXED_POLICY_WINDOW;
use super::worker::Worker;
use super::{Action, Lease, Scheduler, SegmentPolicy, WorkerId};

impl Scheduler {
    /// Grants leases until every worker has enough of them or no rows are left.
    pub(super) fn assign(&mut self, now: Duration) {
        self.recheck_at = None;
        if self.frames.is_empty() && self.verifications.pending.is_empty() {
            return;
        }
        match self.policy {
            SegmentPolicy::Static(_) | SegmentPolicy::Smart(_) => self.assign_fixed(now),
            SegmentPolicy::Adaptive => self.assign_adaptive(now),
        }
    }

    /// The rule of the fixed policies `static` and `smart`: [`FIXED_POLICY_WINDOW`] leases per worker, in order; every
    /// worker gets a first lease before any gets a second one. At the end, idle workers get backup tasks.
    fn assign_fixed(&mut self, now: Duration) {
        let is_able = |worker: &Worker| worker.is_ready(now) && !self.standings.is_excluded(worker);
        let ids = self.ids_of(|worker| is_able(worker) && worker.leases.len() < FIXED_POLICY_WINDOW);
        for depth in 0..FIXED_POLICY_WINDOW {
            for &id in &ids {
                if self.workers.get(&id).is_none_or(|worker| worker.leases.len() != depth) {
                    continue;
                }
                if self.lease_trailing_verification(now, id, None) {
                    continue;
                }
                if let Some(lease) = self.next_fixed_lease(id) {
                    self.grant(now, id, lease, None);
                } else if !self.lease_verification(now, id, None)
                    && depth == 0
                    && !self.is_on_probation(id)
                    && let Some(lease) = self.any_backup(now, id)
                {
                    self.grant(now, id, lease, None);
                }
            }
        }
    }

    fn next_fixed_lease(&mut self, id: WorkerId) -> Option<Lease> {
        let index = self.frames.iter().position(|frame| !frame.queue.is_empty())?;
        if matches!(self.policy, SegmentPolicy::Smart(_)) {
            self.halve_if_near_the_end(index);
        }
        let on_probation = self.is_on_probation(id);
        let frame = self.frames.get_mut(index)?;
        let limit = if on_probation { frame.probation_rows().min(frame.max_rows) } else { frame.max_rows };
        if limit == 0 { None } else { frame.lease_front(id, limit) }
    }

    /// The rule of the policy `smart`: the last `workers / 2` segments are halved.
    fn halve_if_near_the_end(&mut self, index: usize) {
        let near_the_end = self.workers.len() / 2;
        let Some(frame) = self.frames.get_mut(index) else { return };
        let whole = frame.queue.iter().filter(|range| !range.halved).count();
        if whole <= near_the_end && frame.queue.front().is_some_and(|range| !range.halved) {
            frame.halve_front();
        }
    }

    /// The rule of the policy `adaptive`: leases of about equal predicted time for all workers with room for one, the
    /// soonest idle first.
    fn assign_adaptive(&mut self, now: Duration) {
        let mut fleet = Fleet::of(self, now);
        loop {
            let mut granted = false;
            for candidate in fleet.soonest_idle_first() {
                granted |= self.lease_one(now, &mut fleet, candidate);
            }
            if !granted {
                break;
            }
        }
        self.speculate(now, &mut fleet);
    }

    /// Grants one lease, the first possible of: a pending verification of a complete frame; rows of the oldest frame
    /// that the worker can finish in time; another pending verification; rows that only unproven workers hold; rows of
    /// the next frame, which begins if it may.
    fn lease_one(&mut self, now: Duration, fleet: &mut Fleet, candidate: usize) -> bool {
        let Some(id) = fleet.id(candidate) else { return false };
        if self.lease_trailing_verification(now, id, Some(&mut *fleet))
            || self.lease_rows(now, fleet, candidate, 0)
            || self.lease_verification(now, id, Some(&mut *fleet))
            || self.back_up_unproven(now, id, fleet)
        {
            return true;
        }
        let mut index = 1;
        while let Some(frame) = self.queued_frame(index) {
            if self.lease_rows(now, fleet, candidate, frame) {
                return true;
            }
            index = frame + 1;
        }
        false
    }

    fn lease_rows(&mut self, now: Duration, fleet: &mut Fleet, candidate: usize, frame: usize) -> bool {
        let rows = self.adaptive_rows(frame, fleet, candidate);
        let Some((id, rows)) = fleet.id(candidate).zip(rows) else { return false };
        let lease = self.frames.get_mut(frame).and_then(|frame| frame.lease_front(id, rows));
        lease.into_iter().for_each(|lease| self.grant(now, id, lease, Some(&mut *fleet)));
        lease.is_some()
    }

    /// Index of the oldest frame with queued rows, from `index` on. If there is none, the waiting request begins, where
    /// it may.
    fn queued_frame(&mut self, index: usize) -> Option<usize> {
        let queued = |frames: &VecDeque<Frame>| (index..frames.len()).find(|&n| !frames[n].queue.is_empty());
        queued(&self.frames).or_else(|| {
            if self.may_pipeline() {
                self.begin_waiting();
            }
            queued(&self.frames)
        })
    }

    /// Records a lease of rows for a picture and sends it.
    pub(super) fn grant(&mut self, now: Duration, id: WorkerId, lease: Lease, fleet: Option<&mut Fleet>) {
        let rows = lease.first_row..lease.first_row + lease.row_count;
        let on_probation = self.is_on_probation(id);
        let Some(frame) = self.frames.iter_mut().find(|frame| frame.id == lease.frame) else { return };
        frame.started_at.get_or_insert(now);
        if on_probation {
            frame.rows_on_probation = frame.rows_on_probation.saturating_add(lease.row_count);
        }
        let load = Load::of(&frame.forecast, rows);
        if self.record_lease(now, id, lease, fleet, load, false) {
            self.actions.push_back(Action::Grant { worker: id, lease });
        }
    }

    /// Records a lease of a second rendering and sends it.
    pub(super) fn grant_verification(
        &mut self,
        now: Duration,
        id: WorkerId,
        lease: Lease,
        fleet: Option<&mut Fleet>,
        load: Load,
    ) {
        if self.record_lease(now, id, lease, fleet, load, true) {
            self.actions.push_back(Action::Verify { worker: id, lease });
        }
    }

    /// Records a lease with its prediction and deadline, and announces its frame to the worker. Returns `false` if the
    /// worker is unknown.
    fn record_lease(
        &mut self,
        now: Duration,
        id: WorkerId,
        lease: Lease,
        fleet: Option<&mut Fleet>,
        Load { work, longest_band, bands }: Load,
        verifies: bool,
    ) -> bool {
        // Frames in flight share the workers.
        let frame_interval = self.last_frame / self.max_frames() as u32;
        let Some(worker) = self.workers.get_mut(&id) else { return false };
        let predicted = fleet.and_then(|fleet| fleet.predict(id, work, longest_band));
        let expected_at = predicted.map(|(at, _)| at);
        let deadline =
            predicted.map(|(at, takes)| at.saturating_add(worker.slack(takes, self.overrun, frame_interval)));
        let active = ActiveLease { lease, granted_at: now, work, bands, expected_at, deadline, verifies };
        worker.record(now, active);
        if worker.must_announce(lease.frame) {
            self.actions.push_back(Action::Announce { worker: id, frame: lease.frame });
        }
        true
    }
}
