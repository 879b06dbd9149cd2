//! When somebody does not do what it has promised: late leases, silence, refusals.

use std::time::Duration;

use super::worker::{self, Service};
use super::{Action, FrameId, Return, Scheduler, WorkerId};

/// So often must every worker refuse a frame, one after the other, before it is given up.
const MAX_REFUSALS: u32 = 3;
/// A worker that owes something and has given nothing for this long is sent away, at first...
pub(super) const FIRST_PATIENCE: Duration = Duration::from_secs(60);
/// ...and twice as long after each time, up to this: a frame may take a slow machine longer than anybody thought.
const LONGEST_PATIENCE: Duration = Duration::from_secs(24 * 3600);

impl Scheduler {
    /// Takes overdue leases back: their rows go to the front of the queue, and whoever is first counts.
    pub(super) fn take_overdue(&mut self, now: Duration) {
        for id in self.ids_of(|worker| worker.overdue_at().is_some_and(|at| at <= now)) {
            let taken = self.workers.get_mut(&id).map(|worker| worker.lapse(now)).unwrap_or_default();
            self.requeue(id, taken);
        }
    }

    /// Rows that a worker held go to the front of the queue, in order.
    pub(super) fn requeue(&mut self, id: WorkerId, taken: Vec<(FrameId, u32)>) {
        for (frame, segment) in taken.into_iter().rev() {
            self.reopen_audit(id, (frame, segment));
            if let Some(frame) = self.frames.iter_mut().find(|known| known.id == frame) {
                frame.give_up(segment, id);
            }
        }
        self.draw_anew(id);
    }

    /// Sends away who answers pings but has long given nothing of what it owes.
    pub(super) fn dismiss_stuck(&mut self, now: Duration) {
        let patience = self.patience;
        let waited = |since: Option<Duration>| since.is_some_and(|since| since + patience <= now);
        for id in self.ids_of(|worker| waited(worker.waited_for_since())) {
            let reason = format!("it has finished nothing for {} s, and holds segments", patience.as_secs());
            self.dismiss(id, reason, Return::Welcome);
            self.patience = patience.saturating_mul(2).min(LONGEST_PATIENCE);
        }
    }

    /// A worker cannot render: its leases go to others, and it rests before it is tried again.
    pub(super) fn worker_failed(&mut self, now: Duration, id: WorkerId, frame: FrameId) {
        let Some(known) = self.frames.iter_mut().find(|known| known.id == frame) else {
            return self.fail_audits(id, frame);
        };
        let Some(worker) = self.workers.get_mut(&id) else { return };
        if worker.fail(now) {
            known.refuse(id);
        }
        self.take_leases(id);
    }

    /// Gives up frames that everybody who could render them has refused again and again.
    pub(super) fn fail_frames(&mut self) {
        let mut able = self.workers.iter().filter(|(_, worker)| worker.service == Service::Active).peekable();
        if able.peek().is_none() {
            return;
        }
        let able: Vec<WorkerId> = able.map(|(&id, _)| id).collect();
        let refused = |id: &WorkerId, frame: &super::frame::Frame| frame.refusals(*id) >= MAX_REFUSALS;
        let failed = self.frames.iter().find(|frame| able.iter().all(|id| refused(id, frame)));
        if let Some(frame) = failed.map(|frame| frame.id) {
            self.actions.push_back(Action::FrameFailed { frame });
            self.forget_frame(frame);
        }
    }

    /// Pings those who are due and dismisses those who have been silent for too long.
    pub(super) fn check_pulses(&mut self, now: Duration) {
        for id in self.ids_of(|worker| worker.lost_at() <= now) {
            let limit_s = worker::SILENCE_LIMIT.as_secs();
            self.dismiss(id, format!("it has given no sign of life for {limit_s} s"), Return::Welcome);
        }
        for (&worker, known) in self.workers.iter_mut().filter(|(_, known)| known.ping_at() <= now) {
            known.pinged(now, self.next_nonce);
            self.actions.push_back(Action::Ping { worker, nonce: self.next_nonce });
            self.next_nonce += 1;
        }
    }
}
