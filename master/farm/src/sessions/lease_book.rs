//! What one session was granted: the measure of what its worker may answer.

use std::collections::BTreeSet;

use rayfarm_protocol::{FrameId, Lease};

/// Leases taken back that a late answer may still come to; beyond that, the oldest are forgotten. A worker that stands
/// still for some seconds is granted, and loses, eight a frame until it is noticed, and must be forgiven when it wakes.
const MAX_REVOKED: usize = 4096;

/// The leases of one session.
#[derive(Debug, Default)]
pub struct LeaseBook {
    granted: BTreeSet<Lease>,
    verifying: BTreeSet<Lease>,
    revoked: BTreeSet<Lease>,
}

/// What an answer is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// The lease was granted to this session and not answered yet.
    Granted,
    /// The same, of rows that are to be compared with those in the picture.
    Verifying,
    /// It was taken back: the answer was on its way, and is thrown away.
    Revoked,
    /// This session never got such a lease, or has answered it.
    Unknown,
}

impl LeaseBook {
    /// The session gets a lease.
    pub fn grant(&mut self, lease: Lease) {
        self.granted.insert(lease);
    }

    /// The session gets a lease of rows that are verified.
    pub fn verify(&mut self, lease: Lease) {
        self.verifying.insert(lease);
    }

    /// Leases of frames before `before` are taken back.
    pub fn cancel(&mut self, before: FrameId) {
        self.revoke(|lease| lease.frame < before);
    }

    /// The worker says that it cannot render a frame.
    pub fn fail(&mut self, frame: FrameId) {
        self.revoke(|lease| lease.frame == frame);
    }

    /// An answer arrives. Each lease is answered once.
    pub fn answer(&mut self, lease: &Lease) -> Standing {
        if self.granted.remove(lease) {
            Standing::Granted
        } else if self.verifying.remove(lease) {
            Standing::Verifying
        } else if self.revoked.remove(lease) {
            Standing::Revoked
        } else {
            Standing::Unknown
        }
    }

    fn revoke(&mut self, which: impl Fn(&Lease) -> bool) {
        self.revoked.extend(self.granted.extract_if(.., |lease| which(lease)));
        self.revoked.extend(self.verifying.extract_if(.., |lease| which(lease)));
        while self.revoked.len() > MAX_REVOKED {
            self.revoked.pop_first();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lease(frame: u64, segment: u32) -> Lease {
        Lease { frame: FrameId(frame), segment, attempt: 0, first_row: 0, row_count: 1 }
    }

    #[test]
    fn a_lease_is_answered_once_and_only_as_granted() {
        let mut book = LeaseBook::default();
        book.grant(lease(1, 0));
        assert_eq!(book.answer(&Lease { attempt: 1, ..lease(1, 0) }), Standing::Unknown);
        book.verify(lease(1, 1));
        assert_eq!(book.answer(&lease(1, 0)), Standing::Granted);
        assert_eq!(book.answer(&lease(1, 0)), Standing::Unknown);
        assert_eq!(book.answer(&lease(1, 1)), Standing::Verifying);
        assert_eq!(book.answer(&lease(1, 1)), Standing::Unknown);
    }

    #[test]
    fn an_answer_that_was_on_its_way_is_no_offence() {
        let mut book = LeaseBook::default();
        for (frame, segment) in [(1, 0), (2, 0), (3, 0)] {
            book.grant(lease(frame, segment));
        }
        book.verify(lease(1, 1));
        book.cancel(FrameId(2));
        book.fail(FrameId(3));
        assert_eq!(book.answer(&lease(1, 1)), Standing::Revoked);
        assert_eq!(book.answer(&lease(1, 0)), Standing::Revoked);
        assert_eq!(book.answer(&lease(1, 0)), Standing::Unknown);
        assert_eq!(book.answer(&lease(2, 0)), Standing::Granted);
        assert_eq!(book.answer(&lease(3, 0)), Standing::Revoked);
    }

    #[test]
    fn what_was_taken_back_is_forgotten_in_the_end() {
        let mut book = LeaseBook::default();
        for segment in 0..2 * MAX_REVOKED as u32 {
            book.grant(lease(1, segment));
            book.cancel(FrameId(2));
        }
        assert!(book.granted.is_empty());
        assert_eq!(book.revoked.len(), MAX_REVOKED);
    }
}
