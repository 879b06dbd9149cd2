//! Simulated pictures: the owner and the error value of every row.

use std::ops::Range;

use rayfarm_scheduler::{Lease, WorkerId};

/// Owner of a row's pixels, and their error value: 0 where they are right.
type Pixels = (WorkerId, u64);

/// Picture of a frame in flight.
#[derive(Debug)]
pub(super) struct Picture {
    filled: Vec<Option<Pixels>>,
    granted: Vec<bool>,
    ungranted: usize,
}

/// Row indices of a lease.
pub(super) fn rows(lease: &Lease) -> Range<usize> {
    lease.first_row as usize..(lease.first_row + lease.row_count) as usize
}

impl Picture {
    pub(super) fn new(rows: u32) -> Self {
        let rows = rows as usize;
        Self { filled: vec![None; rows], granted: vec![false; rows], ungranted: rows }
    }

    /// Marks the rows of a lease granted. Returns whether the last ungranted row was among them; `None` if the
    /// lease exceeds the picture.
    pub(super) fn grant(&mut self, lease: &Lease) -> Option<bool> {
        let granted = self.granted.get_mut(rows(lease))?;
        let fresh = granted.iter_mut().filter(|granted| !**granted).map(|granted| *granted = true).count();
        self.ungranted -= fresh;
        Some(fresh > 0 && self.ungranted == 0)
    }

    /// Fills the rows of a lease; rows that are filled already keep their pixels.
    pub(super) fn fill(&mut self, worker: WorkerId, lease: &Lease, content: u64) {
        for filled in self.filled.get_mut(rows(lease)).into_iter().flatten() {
            filled.get_or_insert((worker, content));
        }
    }

    /// Sum of the error values of a lease's rows, if all of them are this worker's.
    pub(super) fn digest(&self, worker: WorkerId, lease: &Lease) -> Option<u64> {
        let sum = |sum: u64, row: &Option<Pixels>| {
            row.filter(|(owner, _)| *owner == worker).map(|(_, content)| sum.wrapping_add(content))
        };
        self.filled.get(rows(lease))?.iter().try_fold(0, sum)
    }

    /// Empties a worker's rows and returns their numbers.
    pub(super) fn reject(&mut self, worker: WorkerId) -> Vec<u32> {
        let rows = self.filled.iter_mut().zip(0..);
        let its = rows.filter(|(filled, _)| filled.is_some_and(|(owner, _)| owner == worker));
        its.map(|(filled, row)| (*filled = None, row).1).collect()
    }

    /// The first empty row.
    pub(super) fn missing(&self) -> Option<usize> {
        self.filled.iter().position(Option::is_none)
    }

    /// Owners of wrong rows.
    pub(super) fn wrong(&self) -> impl Iterator<Item = WorkerId> {
        self.filled.iter().flatten().filter(|(_, content)| *content != 0).map(|(worker, _)| *worker)
    }
}
