//! Trust in workers, and bounds for untrusted ones.
//!
//! An untrusted worker may be any program that reaches the master's port. While a trusted worker renders, the hosts of
//! untrusted workers are on *probation*: together they get a bounded share of the rows of each frame, in small leases, and
//! no backup tasks. A trusted worker renders each of these segments again, and the probation of a host ends after
//! [`CONFIRMATIONS`] equal segments. Later on, [`UNTRUSTED_PERCENT`] per cent of its segments are rendered again. A host
//! of a banned worker gets no leases, because the worker could return under another name.
//!
//! While no trusted worker renders, there is no bound: a frame must not wait, and nothing can confirm a segment.

use std::collections::BTreeMap;

use super::frame::Frame;
use super::worker::Worker;
use super::{HostId, Scheduler, WorkerId};

/// Segments of a host that trusted workers must have confirmed before its probation ends.
pub(super) const CONFIRMATIONS: u32 = 16;
/// Divisor of the rows of a frame: the share of all hosts on probation together.
const PROBATION_PART: u32 = 4;
/// Divisor of the rows of a frame: the largest lease on probation. [`CONFIRMATIONS`] of these leases are within the share of
/// one frame.
const PROBATION_LEASES: u32 = PROBATION_PART * CONFIRMATIONS;
/// Part of the segments of an untrusted worker after its probation that is rendered again, in per cent.
const UNTRUSTED_PERCENT: u8 = 6;
/// Hosts of untrusted workers that are remembered. Further ones stay on probation.
const MAX_HOSTS: usize = 4096;

/// Results of comparisons for the hosts of untrusted workers.
#[derive(Debug, Default)]
pub(super) struct Standings {
    hosts: BTreeMap<HostId, Standing>,
    /// Whether there was a trusted worker that renders when leases were last assigned.
    has_trusted: bool,
}

/// Result of comparisons for one host.
#[derive(Clone, Copy, Debug)]
enum Standing {
    /// Number of confirmed segments, up to [`CONFIRMATIONS`].
    Confirmed(u32),
    /// A worker of this host was banned.
    Banned,
}

impl Standings {
    /// Records that a trusted rendering of a segment equals that of an untrusted worker of this host.
    pub(super) fn confirm(&mut self, host: HostId) {
        if self.hosts.len() >= MAX_HOSTS && !self.hosts.contains_key(&host) {
            return;
        }
        if let Standing::Confirmed(count) = self.hosts.entry(host).or_insert(Standing::Confirmed(0)) {
            *count = (*count + 1).min(CONFIRMATIONS);
        }
    }

    /// Records that an untrusted worker of this host was banned.
    pub(super) fn ban(&mut self, host: HostId) {
        if self.hosts.len() < MAX_HOSTS || self.hosts.contains_key(&host) {
            self.hosts.insert(host, Standing::Banned);
        }
    }

    /// Forgets the results for a host: its probation begins.
    pub(super) fn forget(&mut self, host: HostId) {
        self.hosts.remove(&host);
    }

    /// Whether a worker gets no leases now because another one of its host was banned.
    pub(super) fn is_excluded(&self, worker: &Worker) -> bool {
        let is_banned = || matches!(self.hosts.get(&worker.host), Some(Standing::Banned));
        !worker.trusted && self.has_trusted && is_banned()
    }

    fn is_confirmed(&self, host: HostId) -> bool {
        matches!(self.hosts.get(&host), Some(Standing::Confirmed(CONFIRMATIONS..)))
    }

    /// Whether there was a trusted worker that renders when leases were last assigned.
    pub(super) fn has_trusted(&self) -> bool {
        self.has_trusted
    }

    /// Whether a worker is on probation now.
    pub(super) fn is_on_probation(&self, worker: &Worker) -> bool {
        !worker.trusted && self.has_trusted && !self.is_confirmed(worker.host)
    }

    /// The part of a worker's segments that trusted workers render again, in per cent; 0 for trusted workers.
    pub(super) fn percent(&self, worker: &Worker) -> u8 {
        match () {
            () if worker.trusted || !self.has_trusted => 0,
            () if self.is_confirmed(worker.host) => UNTRUSTED_PERCENT,
            () => 100,
        }
    }
}

impl Frame {
    /// Most rows of the next lease of a worker on probation; 0 where the share of all of them is used up.
    pub(super) fn probation_rows(&self) -> u32 {
        let share = (self.height / PROBATION_PART).max(1);
        (self.height / PROBATION_LEASES).max(1).min(share.saturating_sub(self.rows_on_probation))
    }
}

impl Scheduler {
    /// Whether a worker is on probation now.
    pub(super) fn is_on_probation(&self, id: WorkerId) -> bool {
        self.workers.get(&id).is_some_and(|worker| self.standings.is_on_probation(worker))
    }

    /// Updates whether there is a trusted worker that renders.
    pub(super) fn note_trusted(&mut self) {
        let now = self.handled_at;
        self.standings.has_trusted = self.workers.values().any(|worker| worker.vouches(now));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOST: HostId = HostId(7);

    #[test]
    fn probation_ends_with_the_last_confirmation_and_a_ban_is_final() {
        let mut standings = Standings::default();
        for _ in 0..CONFIRMATIONS {
            assert!(!standings.is_confirmed(HOST));
            standings.confirm(HOST);
        }
        assert!(standings.is_confirmed(HOST) && !standings.is_confirmed(HostId(8)));
        standings.ban(HOST);
        (0..=CONFIRMATIONS).for_each(|_| standings.confirm(HOST));
        assert!(!standings.is_confirmed(HOST));
        standings.forget(HOST);
        (0..CONFIRMATIONS).for_each(|_| standings.confirm(HOST));
        assert!(standings.is_confirmed(HOST));
    }

    #[test]
    fn the_number_of_hosts_is_bounded() {
        let mut standings = Standings::default();
        (0..2 * MAX_HOSTS as u128).for_each(|host| standings.confirm(HostId(host)));
        (0..2 * MAX_HOSTS as u128).for_each(|host| standings.ban(HostId(host)));
        assert_eq!(standings.hosts.len(), MAX_HOSTS);
    }
}
