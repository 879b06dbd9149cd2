//! Bound of the log lines about connections of one host: a peer that connects in a loop must not fill the log.

use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayfarm_protocol::admission::host_number;

use crate::bucket::Rate;
use crate::host_table::HostTable;
use crate::line_budget::LineBudget;

/// Connections of one host that are logged: a farm of many workers on one host may join at once.
const RATE: Rate = Rate { burst: 64.0, per_second: 0.5 };

/// Connections that are logged, for each host.
#[derive(Debug, Default)]
pub(crate) struct LogLines(Mutex<HostTable<LineBudget>>);

impl LogLines {
    /// Number of connections that were left out since the last logged one; `None` if a connection of this address is not logged.
    pub(crate) fn next(&self, address: IpAddr, now: Instant) -> Option<u64> {
        let mut hosts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        hosts.entry(host_number(address), now, || LineBudget::new(RATE, now)).next(now)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_loop_of_connections_is_logged_at_a_bounded_rate() {
        let (start, lines) = (Instant::now(), LogLines::default());
        let address = IpAddr::from([10, 0, 0, 1]);
        // 1,000 connections a second for ten seconds.
        let times = (0..10_000).map(|step| start + Duration::from_millis(step));
        let logged: Vec<u64> = times.filter_map(|now| lines.next(address, now)).collect();
        assert!((64..=70).contains(&logged.len()), "{}", logged.len());
        assert!(logged.iter().sum::<u64>() > 7000, "the connections that are left out are counted");
        assert_eq!(
            lines.next(IpAddr::from([10, 0, 0, 2]), start),
            Some(0),
            "another host has lines of its own"
        );
    }
}
