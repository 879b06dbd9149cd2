//! The master's shell without its sockets: the books of leases, the rows of the pictures and what is sealed of them, and
//! what must hold there.

use std::collections::{BTreeMap, BTreeSet};

use super::lies::Lie;
use super::pictures::Picture;
use crate::lease_book::{LeaseBook, Standing};
use crate::scheduler::{ArbiterResult, Event, Finding, FrameId, Lease, WorkerId};

/// What the driver keeps.
#[derive(Debug, Default)]
pub(crate) struct Shell {
    pub(crate) books: BTreeMap<WorkerId, LeaseBook>,
    announced: BTreeMap<WorkerId, BTreeSet<FrameId>>,
    pictures: BTreeMap<FrameId, Picture>,
    seals: BTreeMap<(FrameId, u32), Seal>,
    /// Workers that send wrong pixels, and those that were sent away for it.
    pub(crate) liars: BTreeMap<WorkerId, Lie>,
    pub(crate) expelled: BTreeSet<WorkerId>,
    /// Frames that have ended, complete or not.
    pub(crate) ended: BTreeSet<FrameId>,
    pub(crate) last_done: Option<FrameId>,
}

/// What was sent for the picture, and what was sent to verify it.
#[derive(Debug)]
struct Seal {
    worker: WorkerId,
    painter: u64,
    checker: Option<u64>,
}

/// What became of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// They are in the picture: the scheduler is told.
    Kept,
    /// They were compared with those in the picture: the scheduler is told.
    Compared(Finding),
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
        match self.pictures.insert(frame, Picture::new(rows)) {
            Some(_) => Err(format!("{frame:?} begins twice")),
            None => Ok(()),
        }
    }

    pub(crate) fn announce(&mut self, worker: WorkerId, frame: FrameId) {
        self.announced.entry(worker).or_default().insert(frame);
    }

    pub(crate) fn cancel(&mut self, worker: WorkerId, before: FrameId) {
        if let Some(book) = self.books.get_mut(&worker) {
            book.cancel(before);
        }
        if let Some(frames) = self.announced.get_mut(&worker) {
            frames.retain(|frame| *frame >= before);
        }
    }

    /// The book of a worker that can render a lease.
    fn book(&mut self, worker: WorkerId, lease: Lease) -> Result<&mut LeaseBook, String> {
        let told = self.announced.get(&worker).is_some_and(|frames| frames.contains(&lease.frame));
        if !told {
            return Err(format!("{lease} goes to {worker}, which does not know the frame"));
        }
        self.books.get_mut(&worker).ok_or_else(|| format!("{lease} goes to {worker}, which is gone"))
    }

    /// A lease goes out. Returns whether it was the one that gave away the last row of its frame.
    pub(crate) fn grant(&mut self, worker: WorkerId, lease: Lease) -> Result<bool, String> {
        self.book(worker, lease)?.grant(lease);
        let picture = self.pictures.get_mut(&lease.frame);
        let picture = picture.ok_or_else(|| format!("{lease} of a frame that is not in flight"))?;
        picture.grant(&lease).ok_or_else(|| format!("{lease} leaves the picture"))
    }

    /// A lease of rows that are compared goes out.
    pub(crate) fn verify(&mut self, worker: WorkerId, lease: Lease) -> Result<(), String> {
        self.book(worker, lease)?.verify(lease);
        Ok(())
    }

    /// Pixels arrive, as the driver would let them.
    pub(crate) fn answer(&mut self, worker: WorkerId, lease: &Lease, fits: bool, content: u64) -> Answer {
        let Some(book) = self.books.get_mut(&worker) else { return Answer::Late };
        match (book.answer(lease), self.pictures.get_mut(&lease.frame)) {
            (Standing::Unknown, _) => Answer::Refused,
            (Standing::Granted | Standing::Verifying, _) if !fits => Answer::Refused,
            (Standing::Verifying, _) => Answer::Compared(self.compare(lease, content)),
            (Standing::Revoked, _) | (Standing::Granted, None) => Answer::Late,
            (Standing::Granted, Some(picture)) => {
                picture.fill(worker, lease, content);
                Answer::Kept
            }
        }
    }

    fn compare(&mut self, lease: &Lease, content: u64) -> Finding {
        let Some(seal) = self.seals.get_mut(&(lease.frame, lease.segment)) else { return Finding::Unknown };
        let content = content.wrapping_mul(u64::from(lease.row_count));
        if content == seal.painter {
            return Finding::Same;
        }
        seal.checker = Some(content);
        Finding::Different
    }

    pub(crate) fn seal(&mut self, worker: WorkerId, lease: Lease) {
        let picture = self.pictures.get(&lease.frame);
        if let Some(painter) = picture.and_then(|picture| picture.digest(worker, &lease)) {
            self.seals.insert((lease.frame, lease.segment), Seal { worker, painter, checker: None });
        }
    }

    pub(crate) fn unseal(&mut self, frame: FrameId, segment: u32) {
        self.seals.remove(&(frame, segment));
    }

    pub(crate) fn judge(&self, frame: FrameId, segment: u32) -> ArbiterResult {
        let seal = self.seals.get(&(frame, segment));
        seal.map_or(ArbiterResult::default(), |seal| ArbiterResult {
            rendered: true,
            first_differs: seal.painter != 0,
            second_differs: seal.checker.is_some_and(|content| content != 0),
        })
    }

    /// Where a lease is a second rendering: whose the first one was, and what was sent for each row.
    pub(super) fn sealed_by(&self, lease: &Lease) -> Option<(WorkerId, u64)> {
        let seal = self.seals.get(&(lease.frame, lease.segment))?;
        Some((seal.worker, seal.painter / u64::from(lease.row_count.max(1))))
    }

    /// Rows that are sealed.
    pub(crate) fn sealed(&self) -> u64 {
        self.seals.len() as u64
    }

    /// A worker is sent away for good: its rows leave all pictures.
    pub(crate) fn expel(&mut self, worker: WorkerId) -> (Vec<Event>, Result<(), String>) {
        self.expelled.insert(worker);
        let rejected = |(&frame, picture): (&FrameId, &mut Picture)| {
            let event = move |row| Event::RowsRejected { frame, first_row: row, row_count: 1 };
            picture.reject(worker).into_iter().map(event)
        };
        let events = self.pictures.iter_mut().flat_map(rejected).collect();
        let deserved = self.liars.contains_key(&worker);
        (events, if deserved { Ok(()) } else { Err(format!("{worker} is expelled and never lied")) })
    }

    /// A frame is shown. Whether it is the wrong picture.
    pub(crate) fn done(&mut self, frame: FrameId) -> Result<bool, String> {
        let picture =
            self.pictures.remove(&frame).ok_or_else(|| format!("{frame:?} is done and never began"))?;
        if let Some(row) = picture.missing() {
            return Err(format!("{frame:?} is called complete without row {row}"));
        }
        if let Some(liar) = picture.wrong().find(|worker| self.expelled.contains(worker)) {
            return Err(format!("{frame:?} shows wrong rows of {liar}, which was expelled"));
        }
        if self.last_done >= Some(frame) {
            return Err(format!("{frame:?} is done after {:?}", self.last_done));
        }
        self.last_done = Some(frame);
        self.end(frame)?;
        Ok(picture.wrong().next().is_some())
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
