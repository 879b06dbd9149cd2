//! The master's shell without its sockets: the books of leases and the rows of the pictures, and what must hold there.

use std::collections::{BTreeMap, BTreeSet};

use crate::lease_book::{LeaseBook, Standing};
use crate::scheduler::{FrameId, Lease, WorkerId};

/// A frame that has begun.
#[derive(Debug)]
struct Picture {
    filled: Vec<bool>,
    granted: Vec<bool>,
    ungranted: usize,
}

/// What the driver keeps.
#[derive(Debug, Default)]
pub(crate) struct Shell {
    pub(crate) books: BTreeMap<WorkerId, LeaseBook>,
    announced: BTreeMap<WorkerId, BTreeSet<FrameId>>,
    pictures: BTreeMap<FrameId, Picture>,
    /// Frames that have ended, complete or not.
    pub(crate) ended: BTreeSet<FrameId>,
    pub(crate) last_done: Option<FrameId>,
}

/// What became of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// They are in the picture: the scheduler is told.
    Kept,
    /// Nobody wants them any more.
    Late,
    /// The worker is dismissed.
    Refused,
}

impl Shell {
    pub(crate) fn join(&mut self, worker: WorkerId) {
        self.books.insert(worker, LeaseBook::default());
        self.announced.insert(worker, BTreeSet::new());
    }

    pub(crate) fn leave(&mut self, worker: WorkerId) {
        self.books.remove(&worker);
        self.announced.remove(&worker);
    }

    pub(crate) fn begin(&mut self, frame: FrameId, rows: u32) -> Result<(), String> {
        let rows = rows as usize;
        let picture = Picture { filled: vec![false; rows], granted: vec![false; rows], ungranted: rows };
        match self.pictures.insert(frame, picture) {
            Some(_) => Err(format!("{frame:?} begins twice")),
            None => Ok(()),
        }
    }

    pub(crate) fn announce(&mut self, worker: WorkerId, frame: FrameId) {
        self.announced.entry(worker).or_default().insert(frame);
    }

    /// A lease goes out. Returns whether it was the one that gave away the last row of its frame.
    pub(crate) fn grant(&mut self, worker: WorkerId, lease: Lease) -> Result<bool, String> {
        let told = self.announced.get(&worker).is_some_and(|frames| frames.contains(&lease.frame));
        let picture = self.pictures.get_mut(&lease.frame);
        let picture = picture.ok_or_else(|| format!("{lease} of a frame that is not in flight"))?;
        let book =
            self.books.get_mut(&worker).ok_or_else(|| format!("{lease} goes to {worker}, which is gone"))?;
        if !told {
            return Err(format!("{lease} goes to {worker}, which was not told of the frame"));
        }
        book.grant(lease);
        let rows = lease.first_row as usize..(lease.first_row + lease.row_count) as usize;
        let granted = picture.granted.get_mut(rows).ok_or_else(|| format!("{lease} leaves the picture"))?;
        let fresh = granted.iter_mut().filter(|granted| !**granted).map(|granted| *granted = true).count();
        picture.ungranted -= fresh;
        Ok(fresh > 0 && picture.ungranted == 0)
    }

    /// Pixels arrive, as the driver would let them.
    pub(crate) fn answer(&mut self, worker: WorkerId, lease: &Lease, fits: bool) -> Answer {
        let Some(book) = self.books.get_mut(&worker) else { return Answer::Late };
        match (book.answer(lease), self.pictures.get_mut(&lease.frame)) {
            (Standing::Unknown, _) => Answer::Refused,
            (Standing::Revoked, _) | (Standing::Granted, None) => Answer::Late,
            (Standing::Granted, Some(_)) if !fits => Answer::Refused,
            (Standing::Granted, Some(picture)) => {
                let rows = lease.first_row as usize..(lease.first_row + lease.row_count) as usize;
                picture.filled.get_mut(rows).into_iter().flatten().for_each(|filled| *filled = true);
                Answer::Kept
            }
        }
    }

    pub(crate) fn done(&mut self, frame: FrameId) -> Result<(), String> {
        let picture =
            self.pictures.remove(&frame).ok_or_else(|| format!("{frame:?} is done and never began"))?;
        if let Some(row) = picture.filled.iter().position(|filled| !filled) {
            return Err(format!("{frame:?} is called complete without row {row}"));
        }
        if self.last_done >= Some(frame) {
            return Err(format!("{frame:?} is done after {:?}", self.last_done));
        }
        self.last_done = Some(frame);
        self.end(frame)
    }

    /// A frame that is given up.
    pub(crate) fn drop(&mut self, frame: FrameId) -> Result<(), String> {
        self.pictures.remove(&frame);
        self.end(frame)
    }

    fn end(&mut self, frame: FrameId) -> Result<(), String> {
        if self.ended.insert(frame) { Ok(()) } else { Err(format!("{frame:?} ends twice")) }
    }
}
