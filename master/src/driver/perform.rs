//! What the scheduler wants done.

use std::collections::VecDeque;
use std::time::Duration;

use rayfarm_protocol::{FrameId, ToWorker};

use super::{Driver, Inner, Requested};
use crate::farm::{FarmError, FinishedFrame};
use crate::roster::Unreachable;
use crate::scheduler::{Action, Cost, Event, Reconnect, WorkerId};

impl Driver {
    /// Performs an action; what comes of it at once goes to `events`.
    pub(super) fn perform(&self, inner: &mut Inner, action: Action, events: &mut VecDeque<Event>) {
        match action {
            Action::BeginFrame { frame } => {
                if let Some(Requested { view, .. }) = inner.views.get(&frame) {
                    self.framebuffers.open(frame, view.width, view.height);
                }
            }
            Action::FrameDone { frame, cost, elapsed } => self.frame_done(inner, frame, cost, elapsed),
            Action::FrameDropped { frame } => {
                inner.views.remove(&frame);
                self.framebuffers.discard(frame);
            }
            Action::FrameFailed { frame } => {
                inner.views.remove(&frame);
                self.framebuffers.discard(frame);
                let reasons = inner.roster.troubles();
                self.hand_out(inner, Err(FarmError::Refused { frame, reasons }));
            }
            Action::Announce { worker, frame } => {
                let requested = inner.views.get(&frame).map(|requested| &requested.announce);
                let announce = requested.or_else(|| inner.seals.announce(frame)).cloned();
                if let Some(announce) = announce {
                    events.extend(send(inner, worker, ToWorker::Frame(announce)));
                }
            }
            Action::Grant { worker, lease } => {
                if let Some(session) = inner.roster.get_mut(worker) {
                    session.leases.grant(lease);
                    events.extend(send(inner, worker, ToWorker::Segment(lease)));
                }
            }
            Action::Cancel { worker, before } => {
                if let Some(session) = inner.roster.get_mut(worker) {
                    session.leases.cancel(before);
                    events.extend(send(inner, worker, ToWorker::Cancel { before }));
                }
            }
            Action::Ping { worker, nonce } => events.extend(send(inner, worker, ToWorker::Ping { nonce })),
            Action::Drain { worker } => events.extend(send(inner, worker, ToWorker::Drain)),
            Action::Disconnect { worker, reason, reconnect } => {
                match reconnect {
                    // It was drained, as its user or the master's wanted.
                    Reconnect::Never => inner.roster.log_departure(worker, &reason),
                    Reconnect::Now | Reconnect::NextMaster => inner.roster.log_dismissal(worker, &reason),
                }
                inner.roster.end(worker, &reason, reconnect);
            }
            Action::RecordDigest { worker, lease } => self.seal(inner, worker, lease),
            Action::Verify { worker, lease } => {
                if let Some(session) = inner.roster.get_mut(worker) {
                    session.leases.verify(lease);
                    events.extend(send(inner, worker, ToWorker::Segment(lease)));
                }
            }
            Action::Arbitrate { frame, segment } => events.extend(self.judge(inner, frame, segment)),
            Action::DropDigest { frame, segment } => inner.seals.remove(frame, segment),
            Action::Ban { worker, reason } => self.expel(inner, worker, &reason, events),
        }
    }

    fn frame_done(&self, inner: &mut Inner, frame: FrameId, cost: Cost, elapsed: Duration) {
        if inner.scheduler.verification().percent > 0 {
            inner.delivered.add(frame, self.framebuffers.workers(frame));
        }
        let picture = inner.views.remove(&frame).zip(self.framebuffers.finish(frame));
        let Some((Requested { view, at, .. }, pixels)) = picture else {
            debug_assert!(false, "frame {frame} was done without all of its pixels");
            return;
        };
        inner.run.done += 1;
        inner.run.pace.note(self.started.elapsed(), inner.run.done as f64);
        let now = inner.roster.byte_count();
        let bytes = now.since(std::mem::replace(&mut inner.counted, now));
        let finished = FinishedFrame {
            frame,
            view,
            pixels,
            counts: cost,
            elapsed,
            latency: self.started.elapsed().saturating_sub(at),
            workers: u32::try_from(inner.roster.len()).unwrap_or(u32::MAX),
            threads: inner.roster.threads(),
            sent_bytes: bytes.sent,
            received_bytes: bytes.received,
            scene_bytes: bytes.scene,
            account: inner.accounts.take_done(),
        };
        self.hand_out(inner, Ok(finished));
    }
}

/// Queues a message; what comes of it when it cannot be.
pub(super) fn send(inner: &mut Inner, worker: WorkerId, message: ToWorker) -> Option<Event> {
    inner.roster.send(worker, message).err().map(|Unreachable| Event::WorkerLeft { worker })
}
