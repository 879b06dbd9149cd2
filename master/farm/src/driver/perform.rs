//! Performs the scheduler's actions.

use std::collections::VecDeque;
use std::time::Duration;

use rayfarm_protocol::limits::MAX_PIXELS_BYTES;
use rayfarm_protocol::{FrameId, Lease, ToWorker};
use rayfarm_scheduler::{Action, Cost, Event, Reconnect, Verification, WorkerId};

use super::{Driver, Inner, Request};
use crate::error::FarmError;
use crate::finished::FinishedFrame;
use crate::sessions::SendFailed;

impl Driver {
    /// Performs an action. Events that follow from it at once are appended to `events`.
    pub(super) fn perform(&self, inner: &mut Inner, action: Action, events: &mut VecDeque<Event>) {
        match action {
            Action::BeginFrame { frame } => {
                if let Some(Request { announce, .. }) = inner.requests.get(&frame) {
                    self.framebuffers.open(frame, announce.width, announce.height, announce.format);
                }
            }
            Action::FrameDone { frame, cost, elapsed } => self.frame_done(inner, frame, cost, elapsed),
            Action::FrameDropped { frame } => {
                inner.requests.remove(&frame);
                self.framebuffers.discard(frame);
            }
            Action::FrameFailed { frame } => {
                inner.requests.remove(&frame);
                self.framebuffers.discard(frame);
                let reasons = inner.sessions.failures();
                self.deliver(inner, Err(FarmError::Refused { frame, reasons }));
            }
            Action::Announce { worker, frame } => {
                let requested = inner.requests.get(&frame).map(|request| &request.announce);
                let announce = requested.or_else(|| inner.open_segments.announce(frame)).cloned();
                if let Some(announce) = announce {
                    if let Some(session) = inner.sessions.get_mut(worker) {
                        session.causes.allow_failure();
                    }
                    events.extend(send(inner, worker, ToWorker::Frame(announce)));
                }
            }
            Action::Grant { worker, lease } => {
                let bytes = pixel_bytes(inner, &lease);
                if let Some(session) = inner.sessions.get_mut(worker) {
                    session.causes.allow_failure();
                    session.leases.grant(lease, bytes);
                    session.bound_pixels();
                    events.extend(send(inner, worker, ToWorker::Segment(lease)));
                }
            }
            Action::Cancel { worker, before } => {
                if let Some(session) = inner.sessions.get_mut(worker) {
                    session.leases.cancel(before);
                    events.extend(send(inner, worker, ToWorker::Cancel { before }));
                }
            }
            Action::Ping { worker, nonce } => {
                if let Some(session) = inner.sessions.get_mut(worker) {
                    session.note_ping(nonce);
                }
                events.extend(send(inner, worker, ToWorker::Ping { nonce }));
            }
            Action::Drain { worker } => events.extend(send(inner, worker, ToWorker::Drain)),
            Action::Disconnect { worker, reason, reconnect } => {
                match reconnect {
                    // The worker was drained on request.
                    Reconnect::Never => inner.sessions.log_leave(worker, &reason),
                    Reconnect::Now | Reconnect::NextMaster => inner.sessions.log_disconnect(worker, &reason),
                }
                inner.sessions.disconnect(worker, &reason, reconnect);
            }
            Action::RecordDigest { worker, lease } => self.open_segment(inner, worker, lease),
            Action::Verify { worker, lease } => {
                let bytes = pixel_bytes(inner, &lease);
                if let Some(session) = inner.sessions.get_mut(worker) {
                    session.causes.allow_failure();
                    session.leases.verify(lease, bytes);
                    session.bound_pixels();
                    events.extend(send(inner, worker, ToWorker::Segment(lease)));
                }
            }
            Action::Arbitrate { frame, segment } => events.extend(self.dispute(inner, frame, segment)),
            Action::DropDigest { frame, segment } => inner.open_segments.remove(frame, segment),
            Action::Ban { worker, reason } => self.ban_for_wrong_pixels(inner, worker, &reason, events),
        }
    }

    fn frame_done(&self, inner: &mut Inner, frame: FrameId, cost: Cost, elapsed: Duration) {
        let Verification { percent, picked, .. } = inner.scheduler.verification();
        if percent > 0 || picked > 0 {
            inner.delivered.add(frame, self.framebuffers.workers(frame));
        }
        let picture = inner.requests.remove(&frame).zip(self.framebuffers.finish(frame));
        let Some((Request { request, view, at, .. }, pixels)) = picture else {
            debug_assert!(false, "frame {frame} is done without all of its pixels");
            return;
        };
        inner.run.done += 1;
        inner.run.pace.note(self.started.elapsed(), inner.run.done as f64);
        let now = inner.sessions.byte_count();
        let bytes = now.since(std::mem::replace(&mut inner.counted, now));
        let finished = FinishedFrame {
            frame,
            request,
            view,
            pixels,
            counts: cost,
            elapsed,
            latency: self.started.elapsed().saturating_sub(at),
            workers: u32::try_from(inner.sessions.len()).unwrap_or(u32::MAX),
            threads: inner.sessions.threads(),
            sent_bytes: bytes.sent,
            received_bytes: bytes.received,
            scene_bytes: bytes.scene,
            account: inner.accounts.take_done(),
        };
        self.deliver(inner, Ok(finished));
    }
}

/// Bytes of the pixels of a lease, as far as its frame is known.
fn pixel_bytes(inner: &Inner, lease: &Lease) -> usize {
    let requested = inner.requests.get(&lease.frame).map(|request| &request.announce);
    let announce = requested.or_else(|| inner.open_segments.announce(lease.frame));
    let bytes = announce.and_then(|it| it.format.segment_bytes(it.width, lease.row_count));
    bytes.unwrap_or(MAX_PIXELS_BYTES)
}

/// Queues a message. Returns the event that follows when the worker is disconnected because its queue is full.
pub(super) fn send(inner: &mut Inner, worker: WorkerId, message: ToWorker) -> Option<Event> {
    inner.sessions.send(worker, message).err().map(|SendFailed| Event::WorkerLeft { worker })
}
