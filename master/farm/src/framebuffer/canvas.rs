//! The picture of one frame in flight.

use std::collections::BTreeSet;
use std::ops::Range;

use rayfarm_protocol::{Lease, PixelFormat};
use rayfarm_scheduler::WorkerId;

use super::Misfit;

/// The rows of one frame, and which worker has rendered each.
#[derive(Debug)]
pub(super) struct Canvas {
    /// Format of the pixels.
    pub(super) format: PixelFormat,
    row_bytes: usize,
    pub(super) pixels: Vec<u8>,
    /// For each row the worker whose pixels it has, if it has any.
    filled: Vec<Option<WorkerId>>,
    missing: usize,
}

impl Canvas {
    /// A picture of `rows` rows of `row_bytes` bytes. The bytes of `pixels` count as missing.
    pub(super) fn new(pixels: Vec<u8>, format: PixelFormat, row_bytes: usize, rows: usize) -> Self {
        Self { format, row_bytes, pixels, filled: vec![None; rows], missing: rows }
    }

    /// Whether every row has pixels.
    pub(super) fn is_complete(&self) -> bool {
        self.missing == 0
    }

    /// Bytes of the rows of a lease.
    ///
    /// # Errors
    /// The lease has rows outside of the picture.
    pub(super) fn bytes_of(&self, lease: Lease) -> Result<usize, Misfit> {
        let rows = self.filled.len();
        match (lease.first_row as usize).checked_add(lease.row_count as usize) {
            Some(end) if end <= rows => Ok(self.row_bytes * lease.row_count as usize),
            _ => Err(Misfit::Rows { lease, rows }),
        }
    }

    /// Copies the rows of a lease into the picture. Rows that have pixels keep them. Returns whether no row had any.
    ///
    /// # Errors
    /// The lease has rows outside of the picture, or `rows` has another length than they; nothing is copied.
    pub(super) fn write(&mut self, from: WorkerId, lease: Lease, rows: &[u8]) -> Result<bool, Misfit> {
        let expected = self.bytes_of(lease)?;
        if rows.len() != expected {
            return Err(Misfit::Bytes { lease, expected, got: rows.len() });
        }
        let (first, count, row_bytes) = (lease.first_row as usize, lease.row_count as usize, self.row_bytes);
        let outside = Misfit::Rows { lease, rows: self.filled.len() };
        let filled = self.filled.get_mut(first..first + count).ok_or(outside)?;
        let target = self.pixels.get_mut(first * row_bytes..(first + count) * row_bytes).ok_or(outside)?;
        let all_new = filled.iter().all(Option::is_none);
        if all_new {
            target.copy_from_slice(rows);
        } else {
            let rows = target.chunks_exact_mut(row_bytes.max(1)).zip(rows.chunks_exact(row_bytes.max(1)));
            let missing = rows.zip(&*filled).filter(|(_, filled)| filled.is_none());
            missing.for_each(|((target, row), _)| target.copy_from_slice(row));
        }
        for filled in filled.iter_mut().filter(|filled| filled.is_none()) {
            *filled = Some(from);
            self.missing -= 1;
        }
        Ok(all_new)
    }

    /// Whether all rows of a lease have this worker's pixels.
    pub(super) fn is_all_of(&self, worker: WorkerId, lease: Lease) -> bool {
        let end = (lease.first_row as usize).saturating_add(lease.row_count as usize);
        let rows = self.filled.get(lease.first_row as usize..end);
        rows.is_some_and(|rows| rows.iter().all(|filled| *filled == Some(worker)))
    }

    /// A copy of the rows of a lease, if all of them have this worker's pixels.
    pub(super) fn copy_of(&self, worker: WorkerId, lease: Lease) -> Option<Vec<u8>> {
        let start = lease.first_row as usize * self.row_bytes;
        let rows = || self.pixels.get(start..start + lease.row_count as usize * self.row_bytes);
        self.is_all_of(worker, lease).then(rows).flatten().map(<[u8]>::to_vec)
    }

    /// The workers whose rows are in the picture.
    pub(super) fn workers(&self) -> BTreeSet<WorkerId> {
        self.filled.iter().flatten().copied().collect()
    }

    /// Removes the rows of a worker. Returns them as runs.
    pub(super) fn reject(&mut self, worker: WorkerId) -> impl Iterator<Item = Range<u32>> + use<> {
        let mut runs: Vec<Range<u32>> = Vec::new();
        let rejected = self.filled.iter_mut().zip(0..).filter(|(filled, _)| **filled == Some(worker));
        for (filled, row) in rejected {
            *filled = None;
            self.missing += 1;
            match runs.last_mut().filter(|run| run.end == row) {
                Some(run) => run.end = row + 1,
                None => runs.push(row..row + 1),
            }
        }
        runs.into_iter()
    }
}
