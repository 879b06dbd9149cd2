//! Handing out rows: to whom, in which order. How many is the policy's to say.

use std::collections::VecDeque;
use std::ops::Range;
use std::time::Duration;

use super::adaptive::Crew;
use super::forecast::Forecast;
use super::frame::Frame;
use super::held::Held;
use super::policy::SEED_WINDOW;
use super::{Action, Lease, Scheduler, SegmentPolicy, WorkerId};

/// Frames in flight at most: the oldest, and one that idle workers begin while its last rows are rendered.
pub(super) const MAX_FRAMES: usize = 2;

impl Scheduler {
    /// Hands out rows until everybody has enough or nothing is left.
    pub(super) fn assign(&mut self, now: Duration) {
        self.recheck_at = None;
        if self.frames.is_empty() && self.audits.open.is_empty() {
            return;
        }
        match self.policy {
            SegmentPolicy::Static(_) | SegmentPolicy::Smart(_) => self.assign_as_the_seed(now),
            SegmentPolicy::Adaptive => self.assign_by_forecast(now),
        }
    }

    /// The seed's rule: two leases each, in order; everybody gets a first one before anybody gets a second one. At the
    /// end, who is idle repeats what others still hold.
    fn assign_as_the_seed(&mut self, now: Duration) {
        let ids = self.ids_of(|worker| worker.is_ready(now) && worker.leases.len() < SEED_WINDOW);
        for depth in 0..SEED_WINDOW {
            for &id in &ids {
                if self.workers.get(&id).is_none_or(|worker| worker.leases.len() != depth) {
                    continue;
                }
                if self.give_old_audit(now, id, None) {
                    continue;
                }
                if let Some(lease) = self.seed_lease(id) {
                    self.grant(now, id, lease, None);
                } else if !self.give_audit(now, id, None)
                    && depth == 0
                    && let Some(lease) = self.any_copy(now, id)
                {
                    self.grant(now, id, lease, None);
                }
            }
        }
    }

    fn seed_lease(&mut self, id: WorkerId) -> Option<Lease> {
        let index = self.frames.iter().position(|frame| !frame.queue.is_empty())?;
        if matches!(self.policy, SegmentPolicy::Smart(_)) {
            self.halve_if_near_the_end(index);
        }
        let limit = self.max_rows(self.frames.get(index)?.width);
        self.frames.get_mut(index)?.take(id, limit)
    }

    /// The seed's rule: the last n_workers / 2 segments are halved.
    fn halve_if_near_the_end(&mut self, index: usize) {
        let near_the_end = self.workers.len() / 2;
        let Some(frame) = self.frames.get_mut(index) else { return };
        let whole = frame.queue.iter().filter(|run| !run.halved).count();
        if whole <= near_the_end && frame.queue.front().is_some_and(|run| !run.halved) {
            frame.halve_front();
        }
    }

    /// Leases of about equal predicted time to all who have too little to do, soonest idle first.
    fn assign_by_forecast(&mut self, now: Duration) {
        let mut crew = Crew::of(self, now);
        loop {
            let mut granted = false;
            for index in crew.soonest_idle_first() {
                granted |= self.give_one(now, &mut crew, index);
            }
            if !granted {
                break;
            }
        }
        self.copy_for_the_idle(now, &mut crew);
    }

    /// Rows to verify of complete frames; otherwise rows of the oldest frame, if this worker can do some in time; otherwise
    /// more rows to verify; otherwise rows that newcomers hold; otherwise those of the next frame, which begins if it may.
    fn give_one(&mut self, now: Duration, crew: &mut Crew, hand: usize) -> bool {
        let Some(id) = crew.id(hand) else { return false };
        if self.give_old_audit(now, id, Some(&mut *crew))
            || self.give_rows(now, crew, hand, 0)
            || self.give_audit(now, id, Some(&mut *crew))
            || self.give_newcomers_rows(now, id, crew)
        {
            return true;
        }
        let mut index = 1;
        while let Some(frame) = self.frame_from(index) {
            if self.give_rows(now, crew, hand, frame) {
                return true;
            }
            index = frame + 1;
        }
        false
    }

    fn give_rows(&mut self, now: Duration, crew: &mut Crew, hand: usize, frame: usize) -> bool {
        let Some((id, rows)) = crew.id(hand).zip(self.forecast_rows(frame, crew, hand)) else { return false };
        let lease = self.frames.get_mut(frame).and_then(|frame| frame.take(id, rows));
        lease.into_iter().for_each(|lease| self.grant(now, id, lease, Some(&mut *crew)));
        lease.is_some()
    }

    /// The oldest frame, from the `index`th on, of which rows wait. Where none has any, the request that waits begins,
    /// if it may.
    fn frame_from(&mut self, index: usize) -> Option<usize> {
        let queued = |frames: &VecDeque<Frame>| (index..frames.len()).find(|&n| !frames[n].queue.is_empty());
        queued(&self.frames).or_else(|| {
            if self.may_begin_beside() {
                self.begin_waiting();
            }
            queued(&self.frames)
        })
    }

    /// Writes a lease of rows for a picture down and has it sent.
    pub(super) fn grant(&mut self, now: Duration, id: WorkerId, lease: Lease, crew: Option<&mut Crew>) {
        let rows = lease.first_row..lease.first_row + lease.row_count;
        let Some(frame) = self.frames.iter_mut().find(|frame| frame.id == lease.frame) else { return };
        frame.started_at.get_or_insert(now);
        let load = Load::of(&frame.forecast, rows);
        if self.write_down(now, id, lease, crew, load, false) {
            self.actions.push_back(Action::Grant { worker: id, lease });
        }
    }

    /// The same of rows that are verified.
    pub(super) fn grant_audit(
        &mut self,
        now: Duration,
        id: WorkerId,
        lease: Lease,
        crew: Option<&mut Crew>,
        load: Load,
    ) {
        if self.write_down(now, id, lease, crew, load, true) {
            self.actions.push_back(Action::Verify { worker: id, lease });
        }
    }

    /// Notes what a worker holds from now on, when it is expected, and tells the worker of the frame.
    fn write_down(
        &mut self,
        now: Duration,
        id: WorkerId,
        lease: Lease,
        crew: Option<&mut Crew>,
        Load { work, longest, bands }: Load,
        audit: bool,
    ) -> bool {
        // Frames in flight share the workers: one is complete every so often.
        let every = self.last_frame / self.max_frames() as u32;
        let Some(worker) = self.workers.get_mut(&id) else { return false };
        let expected = crew.and_then(|crew| crew.expect(id, work, longest));
        let expected_at = expected.map(|(at, _)| at);
        let deadline =
            expected.map(|(at, takes)| at.saturating_add(worker.slack(takes, self.surprise, every)));
        worker.hold(now, Held { lease, granted_at: now, work, bands, expected_at, deadline, audit });
        if worker.must_announce(lease.frame) {
            self.actions.push_back(Action::Announce { worker: id, frame: lease.frame });
        }
        true
    }
}

/// What rows are expected to take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load {
    work: f64,
    /// Of the most expensive band among them.
    longest: f64,
    /// Bands of tiles.
    bands: u32,
}

impl Load {
    pub(super) fn of(forecast: &Forecast, rows: Range<u32>) -> Self {
        let bands = (rows.len() as u32).div_ceil(forecast.tiles.rows);
        Self { work: forecast.work(rows.clone()), longest: forecast.longest_band(rows), bands }
    }
}
