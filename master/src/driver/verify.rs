//! Rows that are rendered twice: sealed, compared, judged, and what becomes of who has lied.

use std::collections::VecDeque;

use rayfarm_protocol::{FrameId, Lease, PixelsHeader};

use super::{Driver, Inner, Requested};
use crate::delivered::as_text;
use crate::framebuffer::{Misfit, digest};
use crate::judge::Case;
use crate::scheduler::{ArbiterResult, Event, Finding, Reconnect, WorkerId};
use crate::seals::{Seal, Signed};

impl Driver {
    /// Remembers what rows look like. Rows of which some are another worker's are not sealed: nobody could be blamed.
    pub(super) fn seal(&self, inner: &mut Inner, worker: WorkerId, lease: Lease) {
        let Some(Requested { view, announce, .. }) = inner.views.get(&lease.frame) else { return };
        let Some(hash) = self.framebuffers.digest(worker, lease) else { return };
        let painter = Signed { worker, hash };
        inner.seals.add(Seal { lease, view: *view, announce: announce.clone(), painter, checker: None });
    }

    /// Sealed rows have been rendered again: they go into no picture.
    ///
    /// # Errors
    /// They do not fit their lease.
    pub(super) fn verify(&self, worker: WorkerId, header: PixelsHeader, bytes: &[u8]) -> Result<(), Misfit> {
        let PixelsHeader { lease, encoding, cost } = header;
        let width = self.lock().seals.get(lease.frame, lease.segment).map(|seal| seal.view.width);
        let hash = width.map(|width| digest(lease, width as usize * 3, encoding, bytes)).transpose()?;
        let mut inner = self.lock();
        let finding =
            hash.map_or(Finding::Unknown, |hash| inner.seals.compare(&lease, Signed { worker, hash }));
        self.drive(&mut inner, Event::SegmentVerified { worker, lease, cost, finding });
        Ok(())
    }

    /// Has the master trace sealed rows. Those that were never sealed are nobody's fault.
    pub(super) fn judge(&self, inner: &Inner, frame: FrameId, segment: u32) -> Option<Event> {
        let acquitted = Event::SegmentArbitrated { frame, segment, result: ArbiterResult::default() };
        let Some(seal) = inner.seals.get(frame, segment) else { return Some(acquitted) };
        let (painter, checker) = (seal.painter.hash, seal.checker.map(|checker| checker.hash));
        let Lease { first_row, row_count, .. } = seal.lease;
        let rows = first_row..first_row.saturating_add(row_count);
        let case = Case { frame, segment, view: seal.view, rows, painter, checker };
        // Without a court the farm is about to end.
        self.court.send(case).is_err().then_some(acquitted)
    }

    /// Sends a worker away for good. What it has put into pictures that are not complete is rendered again; complete
    /// ones with its rows are wrong from now on.
    pub(super) fn expel(
        &self,
        inner: &mut Inner,
        worker: WorkerId,
        reason: &str,
        events: &mut VecDeque<Event>,
    ) {
        inner.roster.bar(worker);
        inner.roster.log_dismissal(worker, reason);
        inner.roster.end(worker, reason, Reconnect::Never);
        let wrong = inner.delivered.accuse(worker);
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
