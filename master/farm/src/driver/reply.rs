//! The reply that is being handled, with its rows.

use std::ops::Deref;

use rayfarm_protocol::Lease;
use rayfarm_scheduler::WorkerId;

use crate::framebuffer::DecodedRows;

/// A reply whose rows are in their picture. Actions that follow from it refer to its rows.
pub(super) struct Reply {
    pub(super) worker: WorkerId,
    pub(super) lease: Lease,
    pub(super) rows: DecodedRows,
    /// Whether the picture has all of the lease's rows from this reply.
    pub(super) all_new: bool,
}

/// A run of the rows of a reply. It shares the reply's bytes.
pub(super) struct ReplyRows {
    rows: DecodedRows,
    start: usize,
    end: usize,
}

impl Reply {
    /// The rows of `lease`, where they are a part of the reply's rows and the picture has all of these from this reply.
    pub(super) fn rows_of(&self, worker: WorkerId, lease: Lease) -> Option<ReplyRows> {
        let (whole, part) = (self.lease.rows()?, lease.rows()?);
        let is_own = (worker, lease.frame) == (self.worker, self.lease.frame);
        if !self.all_new || !is_own || part.end > whole.end {
            return None;
        }
        let row_bytes = self.rows.len() / self.lease.row_count as usize;
        let start = part.start.checked_sub(whole.start)? as usize * row_bytes;
        Some(ReplyRows { rows: self.rows.clone(), start, end: start + lease.row_count as usize * row_bytes })
    }
}

impl Deref for ReplyRows {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.rows.get(self.start..self.end).unwrap_or_default()
    }
}
