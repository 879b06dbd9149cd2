//! Timeouts and failures: overdue leases, stalled and silent workers, refused frames.

use std::time::Duration;

use super::frame::Frame;
use super::worker::{self, Service};
use super::{Action, FrameId, Reconnect, Scheduler, WorkerId};

/// A frame fails when every active worker has refused it this many times, with no segment finished in between.
const MAX_REFUSALS: u32 = 3;
/// A worker that holds leases and makes no progress for this long is disconnected...
pub(super) const FIRST_STALL_TIMEOUT: Duration = Duration::from_secs(60);
/// ...and the timeout doubles with each such worker, up to this: one tile may take a slow machine longer than this.
const MAX_STALL_TIMEOUT: Duration = Duration::from_secs(24 * 3600);

impl Scheduler {
    /// Revokes overdue leases: their rows go to the front of the queue. The first valid result counts, including a
    /// late one.
    pub(super) fn revoke_overdue(&mut self, now: Duration) {
        for id in self.ids_of(|worker| worker.next_deadline().is_some_and(|at| at <= now)) {
            let revoked = self.workers.get_mut(&id).map(|worker| worker.time_out(now)).unwrap_or_default();
            self.requeue(id, revoked);
        }
    }

    /// Puts rows that a worker held to the front of the queue, in order.
    pub(super) fn requeue(&mut self, id: WorkerId, revoked: Vec<(FrameId, u32)>) {
        for (frame, segment) in revoked.into_iter().rev() {
            self.reopen_verification(id, (frame, segment));
            if let Some(frame) = self.frames.iter_mut().find(|known| known.id == frame) {
                frame.release(segment, id);
            }
        }
        self.redraw_second_renderers(id);
    }

    /// Disconnects workers that answer pings and hold leases, but make no progress within the stall timeout, or finish
    /// no lease within the limit of [`Stall`](super::stall::Stall).
    pub(super) fn disconnect_stalled(&mut self, now: Duration) {
        let timeout = self.stall_timeout;
        let deadlines = self.workers.iter().filter_map(|(&id, worker)| {
            let (at, reason) = worker.stall_deadline(timeout)?;
            (at <= now).then_some((id, reason))
        });
        for (id, reason) in deadlines.collect::<Vec<_>>() {
            self.disconnect(id, reason.to_string(), Reconnect::Now);
            self.stall_timeout = timeout.saturating_mul(2).min(MAX_STALL_TIMEOUT);
        }
    }

    /// Handles a worker that cannot render a frame: its leases are revoked, and it backs off.
    pub(super) fn worker_failed(&mut self, now: Duration, id: WorkerId, frame: FrameId) {
        let Some(known) = self.frames.iter_mut().find(|known| known.id == frame) else {
            return self.fail_verifications(id, frame);
        };
        let Some(worker) = self.workers.get_mut(&id) else { return };
        if worker.back_off(now) {
            known.refuse(id);
        }
        self.revoke_leases(id);
    }

    /// Fails the oldest frame that every active worker has refused [`MAX_REFUSALS`] times.
    pub(super) fn fail_frames(&mut self) {
        let mut able = self.workers.iter().filter(|(_, worker)| worker.service == Service::Active).peekable();
        if able.peek().is_none() {
            return;
        }
        let able: Vec<WorkerId> = able.map(|(&id, _)| id).collect();
        let refused = |id: &WorkerId, frame: &Frame| frame.refusals(*id) >= MAX_REFUSALS;
        let failed = self.frames.iter().find(|frame| able.iter().all(|id| refused(id, frame)));
        if let Some(frame) = failed.map(|frame| frame.id) {
            self.actions.push_back(Action::FrameFailed { frame });
            self.forget_frame(frame);
        }
    }

    /// Sends due pings and disconnects silent workers.
    pub(super) fn keepalive(&mut self, now: Duration) {
        for id in self.silent(now) {
            let limit_s = worker::SILENCE_TIMEOUT.as_secs();
            self.disconnect(id, format!("it has been silent for {limit_s} s"), Reconnect::Now);
        }
        for (&worker, known) in self.workers.iter_mut().filter(|(_, known)| known.next_ping_at() <= now) {
            known.mark_pinged(now, self.next_nonce);
            self.actions.push_back(Action::Ping { worker, nonce: self.next_nonce });
            self.next_nonce += 1;
        }
    }
}
