//! The leases of one session, against which the replies of its worker are checked.

use std::collections::BTreeMap;

use rayfarm_protocol::{FrameId, Lease};

/// Revoked leases for which a late reply is still accepted in silence. A worker that is suspended for some seconds is
/// granted, and loses, up to eight leases a frame until it is disconnected, and its late replies must not end its session.
const MAX_REVOKED: usize = 4096;

/// The leases of one session.
#[derive(Debug, Default)]
pub struct LeaseBook {
    /// With the number of bytes of their pixels, as the other two.
    granted: BTreeMap<Lease, usize>,
    verifying: BTreeMap<Lease, usize>,
    revoked: BTreeMap<Lease, usize>,
    sizes: Sizes,
}

/// A multiset of sizes, in bytes.
#[derive(Debug, Default)]
struct Sizes(BTreeMap<usize, usize>);

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
    /// Adds a lease of rows for the picture, whose pixels have that many bytes.
    pub fn grant(&mut self, lease: Lease, bytes: usize) {
        self.sizes.replace(self.granted.insert(lease, bytes), bytes);
    }

    /// Adds a lease of rows to verify, whose pixels have that many bytes.
    pub fn verify(&mut self, lease: Lease, bytes: usize) {
        self.sizes.replace(self.verifying.insert(lease, bytes), bytes);
    }

    /// Revokes the leases of all frames before `before`.
    pub fn cancel(&mut self, before: FrameId) {
        self.revoke(|lease| lease.frame < before);
    }

    /// Revokes the leases of a frame that the worker cannot render.
    pub fn fail(&mut self, frame: FrameId) {
        self.revoke(|lease| lease.frame == frame);
    }

    /// Number of bytes of the largest lease to which a reply is accepted, revoked ones included: their replies may be on the wire.
    /// `None` where no reply is accepted.
    pub fn largest(&self) -> Option<usize> {
        self.sizes.0.last_key_value().map(|(bytes, _)| *bytes)
    }

    /// Checks a reply and removes its lease, so that each lease accepts one reply.
    pub fn check_reply(&mut self, lease: &Lease) -> LeaseStatus {
        let (status, bytes) = if let Some(bytes) = self.granted.remove(lease) {
            (LeaseStatus::Granted, bytes)
        } else if let Some(bytes) = self.verifying.remove(lease) {
            (LeaseStatus::Verifying, bytes)
        } else if let Some(bytes) = self.revoked.remove(lease) {
            (LeaseStatus::Revoked, bytes)
        } else {
            return LeaseStatus::Unknown;
        };
        self.sizes.remove(bytes);
        status
    }

    fn revoke(&mut self, which: impl Fn(&Lease) -> bool) {
        let granted = self.granted.extract_if(.., |lease, _| which(lease));
        let verifying = self.verifying.extract_if(.., |lease, _| which(lease));
        for (lease, bytes) in granted.chain(verifying) {
            // A lease that was revoked twice accepts one reply, and counts once.
            if let Some(earlier) = self.revoked.insert(lease, bytes) {
                self.sizes.remove(earlier);
            }
        }
        while self.revoked.len() > MAX_REVOKED {
            self.revoked.pop_first().into_iter().for_each(|(_, bytes)| self.sizes.remove(bytes));
        }
    }
}

impl Sizes {
    /// Adds a size in place of an earlier one.
    fn replace(&mut self, earlier: Option<usize>, bytes: usize) {
        *self.0.entry(bytes).or_default() += 1;
        earlier.into_iter().for_each(|earlier| self.remove(earlier));
    }

    fn remove(&mut self, bytes: usize) {
        if let Some(count) = self.0.get_mut(&bytes) {
            *count -= 1;
            if *count == 0 {
                self.0.remove(&bytes);
            }
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
        book.grant(lease(1, 0), 3);
        assert_eq!(book.check_reply(&Lease { attempt: 1, ..lease(1, 0) }), LeaseStatus::Unknown);
        book.verify(lease(1, 1), 3);
        assert_eq!(book.check_reply(&lease(1, 0)), LeaseStatus::Granted);
        assert_eq!(book.check_reply(&lease(1, 0)), LeaseStatus::Unknown);
        assert_eq!(book.check_reply(&lease(1, 1)), LeaseStatus::Verifying);
        assert_eq!(book.check_reply(&lease(1, 1)), LeaseStatus::Unknown);
    }

    #[test]
    fn a_reply_to_a_revoked_lease_is_not_an_error() {
        let mut book = LeaseBook::default();
        for (frame, segment) in [(1, 0), (2, 0), (3, 0)] {
            book.grant(lease(frame, segment), 3);
        }
        book.verify(lease(1, 1), 3);
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
            book.grant(lease(1, segment), 3);
            book.cancel(FrameId(2));
        }
        assert!(book.granted.is_empty());
        assert_eq!(book.revoked.len(), MAX_REVOKED);
    }

    #[test]
    fn the_largest_lease_counts_until_its_reply() {
        let mut book = LeaseBook::default();
        assert_eq!(book.largest(), None);
        book.grant(lease(1, 0), 100);
        book.grant(lease(1, 1), 300);
        book.verify(lease(1, 2), 300);
        assert_eq!(book.largest(), Some(300));
        book.check_reply(&lease(1, 1));
        assert_eq!(book.largest(), Some(300), "another lease has the same size");
        book.check_reply(&lease(1, 1));
        assert_eq!(book.largest(), Some(300), "a second reply removes nothing");
        book.cancel(FrameId(2));
        assert_eq!(book.largest(), Some(300), "the reply to a revoked lease may be on the wire");
        book.check_reply(&lease(1, 2));
        assert_eq!(book.largest(), Some(100));
        book.check_reply(&lease(1, 0));
        assert_eq!(book.largest(), None);
    }

    #[test]
    fn leases_that_are_granted_again_or_forgotten_leave_no_size() {
        let mut book = LeaseBook::default();
        book.grant(lease(1, 0), 500);
        book.grant(lease(1, 0), 200);
        assert_eq!(book.largest(), Some(200));
        book.cancel(FrameId(2));
        book.grant(lease(1, 0), 100);
        book.cancel(FrameId(2));
        assert_eq!(book.largest(), Some(100));
        for segment in 1..=MAX_REVOKED as u32 {
            book.grant(lease(2, segment), 50);
        }
        book.cancel(FrameId(3));
        assert_eq!(book.largest(), Some(50), "the oldest revoked lease is forgotten");
        (1..=MAX_REVOKED as u32).for_each(|segment| _ = book.check_reply(&lease(2, segment)));
        assert_eq!(book.largest(), None);
    }
}
