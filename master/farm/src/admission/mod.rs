//! Admission of connections before their session: a bounded number of pending ones, a delay after failed handshakes, and a
//! bounded number of log lines for each host.

mod backoff;
mod log_lines;
mod refusal_log;

use std::net::IpAddr;
use std::time::Instant;

use rayfarm_protocol::admission::{Admission, AdmissionLimits, Place};

pub(crate) use backoff::Backoff;
pub(crate) use log_lines::LogLines;
use refusal_log::RefusalLog;

/// Most connections in their handshake. Known hosts are those whose workers have delivered pixels in this run.
pub(crate) const LIMITS: AdmissionLimits = AdmissionLimits { unknown: 64, known: 16, here: 32, of_host: 8 };

/// State of all connections of a farm that are not sessions yet.
#[derive(Debug)]
pub(crate) struct Door {
    places: Admission,
    pub(crate) backoff: Backoff,
    /// Log of sessions.
    pub(crate) log_lines: LogLines,
    /// Log of refused connections.
    pub(crate) refusals: RefusalLog,
}

impl Default for Door {
    fn default() -> Self {
        Self {
            places: Admission::new(LIMITS),
            backoff: Backoff::default(),
            log_lines: LogLines::default(),
            refusals: RefusalLog::new(Instant::now()),
        }
    }
}

impl Door {
    /// A place for a connection from this address; `None` if there is none, and the connection must be closed.
    pub(crate) fn enter(&self, address: IpAddr) -> Option<Place> {
        self.places.enter(address)
    }

    /// Records that a worker of this address has delivered pixels.
    pub(crate) fn add_known(&self, address: IpAddr) {
        self.places.add_known(address);
    }

    /// Number of connections in their handshake, and number of connections that were closed in favour of others.
    pub(crate) fn counts(&self) -> (usize, u64) {
        (self.places.pending(), self.places.refused())
    }
}
