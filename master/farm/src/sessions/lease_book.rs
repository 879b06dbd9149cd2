//! The leases of one session, against which the replies of its worker are checked.

use std::collections::BTreeSet;

use rayfarm_protocol::{FrameId, Lease};

/// Revoked leases for which a late reply is still accepted in silence. A worker that is suspended for some seconds is
/// granted, and loses, up to eight leases a frame until it is disconnected, and its late replies must not end its session.
const MAX_REVOKED: usize = 4096;

/// The leases of one session.
#[derive(Debug, Default)]
pub struct LeaseBook {
    granted: BTreeSet<Lease>,
    verifying: BTreeSet<Lease>,
    revoked: BTreeSet<Lease>,
}

/// Outcome of checking a reply against the leases of its session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeaseStatus {
    /// The session holds the lease.
    Granted,
    /// The session holds the lease, and the rows are a second rendering, to be compared with the first.
    Verifying,
    /// The lease was revoked while the reply was on the wire: the reply is dropped.
    Revoked,
    /// The session never held the lease, or has replied to it before.
    Unknown,
}

impl LeaseBook {
    /// Adds a lease of rows for the picture.
    pub fn grant(&mut self, lease: Lease) {
        self.granted.insert(lease);
    }

    /// Adds a lease of rows to verify.
    pub fn verify(&mut self, lease: Lease) {
        self.verifying.insert(lease);
    }

    /// Revokes the leases of all frames before `before`.
    pub fn cancel(&mut self, before: FrameId) {
        self.revoke(|lease| lease.frame < before);
    }

    /// Revokes the leases of a frame that the worker cannot render.
    pub fn fail(&mut self, frame: FrameId) {
        self.revoke(|lease| lease.frame == frame);
    }

    /// Checks a reply and removes its lease, so that each lease accepts one reply.
    pub fn check_reply(&mut self, lease: &Lease) -> LeaseStatus {
        if self.granted.remove(lease) {
            LeaseStatus::Granted
        } else if self.verifying.remove(lease) {
            LeaseStatus::Verifying
        } else if self.revoked.remove(lease) {
            LeaseStatus::Revoked
        } else {
            LeaseStatus::Unknown
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
    fn each_lease_accepts_one_reply() {
        let mut book = LeaseBook::default();
        book.grant(lease(1, 0));
        assert_eq!(book.check_reply(&Lease { attempt: 1, ..lease(1, 0) }), LeaseStatus::Unknown);
        book.verify(lease(1, 1));
        assert_eq!(book.check_reply(&lease(1, 0)), LeaseStatus::Granted);
        assert_eq!(book.check_reply(&lease(1, 0)), LeaseStatus::Unknown);
        assert_eq!(book.check_reply(&lease(1, 1)), LeaseStatus::Verifying);
        assert_eq!(book.check_reply(&lease(1, 1)), LeaseStatus::Unknown);
    }

    #[test]
    fn a_reply_to_a_revoked_lease_is_not_an_error() {
        let mut book = LeaseBook::default();
        for (frame, segment) in [(1, 0), (2, 0), (3, 0)] {
            book.grant(lease(frame, segment));
        }
        book.verify(lease(1, 1));
        book.cancel(FrameId(2));
        book.fail(FrameId(3));
        assert_eq!(book.check_reply(&lease(1, 1)), LeaseStatus::Revoked);
        assert_eq!(book.check_reply(&lease(1, 0)), LeaseStatus::Revoked);
        assert_eq!(book.check_reply(&lease(1, 0)), LeaseStatus::Unknown);
        assert_eq!(book.check_reply(&lease(2, 0)), LeaseStatus::Granted);
        assert_eq!(book.check_reply(&lease(3, 0)), LeaseStatus::Revoked);
    }

    #[test]
    fn the_number_of_revoked_leases_is_bounded() {
        let mut book = LeaseBook::default();
        for segment in 0..2 * MAX_REVOKED as u32 {
            book.grant(lease(1, segment));
            book.cancel(FrameId(2));
        }
        assert!(book.granted.is_empty());
        assert_eq!(book.revoked.len(), MAX_REVOKED);
    }
}
