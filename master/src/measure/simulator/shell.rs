//! The shell of the master without sockets: lease books, pictures and digests, with checks of what must hold for
//! them.

use std::collections::{BTreeMap, BTreeSet};

use rayfarm_farm::{LeaseBook, LeaseStatus};
use rayfarm_scheduler::{ArbiterResult, Event, Finding, FrameId, Lease, WorkerId};

use super::pictures::Picture;
use super::setup::Corruption;

/// State that the driver keeps in the real master.
#[derive(Debug, Default)]
pub(crate) struct Shell {
    pub(crate) books: BTreeMap<WorkerId, LeaseBook>,
    announced: BTreeMap<WorkerId, BTreeSet<FrameId>>,
    pictures: BTreeMap<FrameId, Picture>,
    digests: BTreeMap<(FrameId, u32), RowDigests>,
    /// Workers that send wrong pixels, and banned workers.
    pub(crate) corrupt: BTreeMap<WorkerId, Corruption>,
    pub(crate) banned: BTreeSet<WorkerId>,
    /// Frames that have ended, complete or not.
    pub(crate) ended: BTreeSet<FrameId>,
    pub(crate) last_done: Option<FrameId>,
}

/// Digests of the first and the second rendering of a segment.
#[derive(Debug)]
struct RowDigests {
    worker: WorkerId,
    first: u64,
    second: Option<u64>,
}

/// Outcome of checking a reply against its lease.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReplyOutcome {
    /// The pixels are in the picture; the scheduler gets an event.
    Kept,
    /// They were compared with the first rendering; the scheduler gets an event.
    Compared(Finding),
    /// They are dropped: their frame or lease is gone.
    Late,
    /// The reply is invalid, and the worker is disconnected.
    Invalid,
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

    /// The lease book of a worker that knows the frame of a lease.
    fn book(&mut self, worker: WorkerId, lease: Lease) -> Result<&mut LeaseBook, String> {
        let announced = self.announced.get(&worker).is_some_and(|frames| frames.contains(&lease.frame));
        if !announced {
            return Err(format!("{lease} goes to {worker}, which does not know the frame"));
        }
        self.books.get_mut(&worker).ok_or_else(|| format!("{lease} goes to {worker}, which is gone"))
    }

    /// Grants a lease. Returns whether it covers the last ungranted row of its frame.
    pub(crate) fn grant(&mut self, worker: WorkerId, lease: Lease) -> Result<bool, String> {
        self.book(worker, lease)?.grant(lease, 0);
        let picture = self.pictures.get_mut(&lease.frame);
        let picture = picture.ok_or_else(|| format!("{lease} of a frame that is not in flight"))?;
        picture.grant(&lease).ok_or_else(|| format!("{lease} leaves the picture"))
    }

    /// Grants a lease of a second rendering.
    pub(crate) fn verify(&mut self, worker: WorkerId, lease: Lease) -> Result<(), String> {
        self.book(worker, lease)?.verify(lease, 0);
        Ok(())
    }

    /// Applies a reply as the driver would.
    pub(crate) fn reply(
        &mut self,
        worker: WorkerId,
        lease: &Lease,
        fits: bool,
        content: u64,
    ) -> ReplyOutcome {
        let Some(book) = self.books.get_mut(&worker) else { return ReplyOutcome::Late };
        match (book.check_reply(lease), self.pictures.get_mut(&lease.frame)) {
            (LeaseStatus::Unknown, _) => ReplyOutcome::Invalid,
            (LeaseStatus::Granted | LeaseStatus::Verifying, _) if !fits => ReplyOutcome::Invalid,
            (LeaseStatus::Verifying, _) => ReplyOutcome::Compared(self.compare(lease, content)),
            (LeaseStatus::Revoked, _) | (LeaseStatus::Granted, None) => ReplyOutcome::Late,
            (LeaseStatus::Granted, Some(picture)) => {
                picture.fill(worker, lease, content);
                ReplyOutcome::Kept
            }
        }
    }

    fn compare(&mut self, lease: &Lease, content: u64) -> Finding {
        let Some(digest) = self.digests.get_mut(&(lease.frame, lease.segment)) else {
            return Finding::Unknown;
        };
        let content = content.wrapping_mul(u64::from(lease.row_count));
        if content == digest.first {
            return Finding::Same;
        }
        digest.second = Some(content);
        Finding::Different
    }

    pub(crate) fn record_digest(&mut self, worker: WorkerId, lease: Lease) {
        let picture = self.pictures.get(&lease.frame);
        if let Some(first) = picture.and_then(|picture| picture.digest(worker, &lease)) {
            self.digests.insert((lease.frame, lease.segment), RowDigests { worker, first, second: None });
        }
    }

    pub(crate) fn drop_digest(&mut self, frame: FrameId, segment: u32) {
        self.digests.remove(&(frame, segment));
    }

    pub(crate) fn arbitrate(&self, frame: FrameId, segment: u32) -> ArbiterResult {
        let digest = self.digests.get(&(frame, segment));
        digest.map_or(ArbiterResult::default(), |digest| ArbiterResult {
            rendered: true,
            first_differs: digest.first != 0,
            second_differs: digest.second.is_some_and(|content| content != 0),
        })
    }

    /// For a lease of a second rendering: the worker of the first rendering, and its error value per row.
    pub(super) fn first_rendering(&self, lease: &Lease) -> Option<(WorkerId, u64)> {
        let digest = self.digests.get(&(lease.frame, lease.segment))?;
        Some((digest.worker, digest.first / u64::from(lease.row_count.max(1))))
    }

    /// Number of recorded digests.
    pub(crate) fn digest_count(&self) -> u64 {
        self.digests.len() as u64
    }

    /// Bans a worker and rejects its rows in all pictures in flight. Returns the events that follow.
    pub(crate) fn ban(&mut self, worker: WorkerId) -> (Vec<Event>, Result<(), String>) {
        self.banned.insert(worker);
        let rejected = |(&frame, picture): (&FrameId, &mut Picture)| {
            let event = move |row| Event::RowsRejected { frame, first_row: row, row_count: 1 };
            picture.reject(worker).into_iter().map(event)
        };
        let events = self.pictures.iter_mut().flat_map(rejected).collect();
        let deserved = self.corrupt.contains_key(&worker);
        (events, if deserved { Ok(()) } else { Err(format!("{worker} is banned and sent no wrong pixels")) })
    }

    /// Completes a frame. Returns whether its picture is wrong.
    pub(crate) fn done(&mut self, frame: FrameId) -> Result<bool, String> {
        let picture =
            self.pictures.remove(&frame).ok_or_else(|| format!("{frame:?} is done and never began"))?;
        if let Some(row) = picture.missing() {
            return Err(format!("{frame:?} completes without row {row}"));
        }
        if let Some(owner) = picture.wrong().find(|worker| self.banned.contains(worker)) {
            return Err(format!("{frame:?} shows wrong rows of {owner}, which was banned"));
        }
        if self.last_done >= Some(frame) {
            return Err(format!("{frame:?} is done after {:?}", self.last_done));
        }
        self.last_done = Some(frame);
        self.end(frame)?;
        Ok(picture.wrong().next().is_some())
    }

    /// Drops a frame.
    pub(crate) fn drop(&mut self, frame: FrameId) -> Result<(), String> {
        self.pictures.remove(&frame);
        self.end(frame)
    }

    fn end(&mut self, frame: FrameId) -> Result<(), String> {
        if self.ended.insert(frame) { Ok(()) } else { Err(format!("{frame:?} ends twice")) }
    }
}
