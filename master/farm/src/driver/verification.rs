//! Verification of segments: digests of first and second renderings, disputes, and bans for wrong pixels.

use std::collections::VecDeque;

use bytes::Bytes;
use rayfarm_protocol::{FrameAnnounce, FrameId, Lease, PixelsHeader};
use rayfarm_scheduler::{ArbiterResult, Event, Finding, Reconnect, WorkerId};

use super::{Driver, Inner, Request};
use crate::framebuffer::Misfit;
use crate::verification::arbiter::Dispute;
use crate::verification::delivered::as_text;
use crate::verification::{OpenSegment, Rendering, SegmentDigest};

impl Driver {
    /// Opens a segment for verification: rows of the reply that is being handled. The digest of its first rendering is
    /// computed later, outside of the lock. A segment that has rows of another worker is not opened: a mismatch could not be
    /// attributed.
    pub(super) fn open_segment(&self, inner: &mut Inner, worker: WorkerId, lease: Lease) {
        let Some(Request { view, announce, .. }) = inner.requests.get(&lease.frame) else { return };
        if !self.framebuffers.is_all_of(worker, lease) {
            return;
        }
        let digest = match inner.reply.as_ref().and_then(|reply| reply.rows_of(worker, lease)) {
            Some(rows) => SegmentDigest::of(rows),
            // The worker has sent some of these rows before, in a reply that the scheduler did not count.
            None => match self.framebuffers.copy_of(worker, lease) {
                Some(rows) => SegmentDigest::of(rows),
                None => return,
            },
        };
        inner.uncomputed.push(digest.clone());
        let (first, announce) = (Rendering { worker, digest }, announce.clone());
        inner.open_segments.insert(OpenSegment { lease, view: *view, announce, first, second: None });
    }

    /// Compares a second rendering of an open segment with the first. Its pixels go into no picture. They are decoded and
    /// hashed without a lock.
    ///
    /// # Errors
    /// The pixels do not fit their lease.
    pub(super) fn verify(&self, worker: WorkerId, header: PixelsHeader, bytes: &Bytes) -> Result<(), Misfit> {
        let PixelsHeader { lease, encoding, cost } = header;
        let open = self.lock().open_segments.get(lease.frame, lease.segment).cloned();
        let second = match open {
            Some(OpenSegment { announce: FrameAnnounce { width, format, .. }, first, .. }) => {
                let size = format.row_bytes(width) * lease.row_count as usize;
                let rows = self.framebuffers.decode(lease, format, size, encoding, bytes)?;
                let second = Rendering { worker, digest: SegmentDigest::of(rows.clone()) };
                first.digest.compute();
                second.digest.compute();
                self.framebuffers.recycle(rows);
                Some(second)
            }
            None => None,
        };
        let mut inner = self.lock();
        let finding = second.map_or(Finding::Unknown, |second| inner.open_segments.compare(&lease, second));
        self.drive(&mut inner, Event::SegmentVerified { worker, lease, cost, finding });
        Ok(())
    }

    /// Queues a segment for the arbiter. Where that is impossible, the returned event settles it without a fault.
    pub(super) fn dispute(&self, inner: &Inner, frame: FrameId, segment: u32) -> Option<Event> {
        let no_fault = Event::SegmentArbitrated { frame, segment, result: ArbiterResult::default() };
        let Some(open) = inner.open_segments.get(frame, segment) else { return Some(no_fault) };
        let first = open.first.digest.clone();
        let second = open.second.as_ref().map(|second| second.digest.clone());
        let Lease { first_row, row_count, .. } = open.lease;
        let rows = first_row..first_row.saturating_add(row_count);
        let scene = open.announce.scene;
        let dispute = Dispute { frame, segment, scene, view: open.view, rows, first, second };
        // The queue is closed only while the farm shuts down.
        self.arbiter_queue.send(dispute).is_err().then_some(no_fault)
    }

    /// Bans a worker that has sent wrong pixels. Its rows are removed from the frames in flight, to be rendered again; finished
    /// frames that have rows of it are marked as possibly wrong.
    pub(super) fn ban_for_wrong_pixels(
        &self,
        inner: &mut Inner,
        worker: WorkerId,
        reason: &str,
        events: &mut VecDeque<Event>,
    ) {
        inner.sessions.ban(worker);
        inner.sessions.log_disconnect(worker, reason);
        inner.sessions.disconnect(worker, reason, Reconnect::Never);
        let wrong = inner.delivered.mark_wrong(worker);
        if wrong.count() > 0 {
            let (count, frames) = (wrong.count(), as_text(wrong.runs()));
            tracing::error!("{count} complete frames have rows of {worker} and may be wrong: {frames}");
        }
        for (frame, rows) in self.framebuffers.reject(worker) {
            let row_count = rows.end - rows.start;
            events.push_back(Event::RowsRejected { frame, first_row: rows.start, row_count });
        }
    }
}
