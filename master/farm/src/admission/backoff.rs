//! Delay of the next handshake with a host after consecutive failed handshakes.

use std::net::IpAddr;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rayfarm_protocol::admission::host_number;

use crate::host_table::HostTable;

/// Consecutive failures without a delay: a worker of another version or with an old token may cause a few.
const FREE_FAILURES: u32 = 4;
/// First delay. It doubles with each further failure.
const FIRST_DELAY: Duration = Duration::from_millis(125);
/// Longest delay. A worker still completes its handshake within the limit of five seconds.
const MAX_DELAY: Duration = Duration::from_secs(2);
/// Time after which the failures of a host are forgotten.
const FORGET_AFTER: Duration = Duration::from_secs(60);

/// Failed handshakes of hosts other than this machine.
#[derive(Debug, Default)]
pub(crate) struct Backoff(Mutex<HostTable<Failures>>);

#[derive(Debug)]
struct Failures {
    in_a_row: u32,
    last: Instant,
}

impl Backoff {
    /// Delay before the next handshake with the host of this address. During the delay, the connection is pending; a newer
    /// connection may replace it, like one that has sent nothing.
    pub(crate) fn delay(&self, address: IpAddr, now: Instant) -> Duration {
        let hosts = self.lock();
        let failures = hosts.get(host_number(address)).filter(|failures| failures.is_recent(now));
        let beyond = failures.map_or(0, |failures| failures.in_a_row.saturating_sub(FREE_FAILURES));
        match beyond.checked_sub(1) {
            Some(doublings) => FIRST_DELAY.saturating_mul(1 << doublings.min(8)).min(MAX_DELAY),
            None => Duration::ZERO,
        }
    }

    /// Records a failed handshake. Connections of this machine have no delay, because local workers use them.
    pub(crate) fn failed(&self, address: IpAddr, now: Instant) {
        if address.to_canonical().is_loopback() {
            return;
        }
        let mut hosts = self.lock();
        let failures = hosts.entry(host_number(address), now, || Failures { in_a_row: 0, last: now });
        let before = if failures.is_recent(now) { failures.in_a_row } else { 0 };
        *failures = Failures { in_a_row: before.saturating_add(1), last: now };
    }

    /// Records a completed handshake.
    pub(crate) fn succeeded(&self, address: IpAddr) {
        self.lock().remove(host_number(address));
    }

    fn lock(&self) -> MutexGuard<'_, HostTable<Failures>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Failures {
    fn is_recent(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.last) < FORGET_AFTER
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OTHER: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 1));

    #[test]
    fn the_delay_doubles_after_four_failures_and_is_bounded() {
        let (now, backoff) = (Instant::now(), Backoff::default());
        let delays: Vec<u128> = (0..12)
            .map(|_| {
                let delay = backoff.delay(OTHER, now).as_millis();
                backoff.failed(OTHER, now);
                delay
            })
            .collect();
        assert_eq!(delays, [0, 0, 0, 0, 0, 125, 250, 500, 1000, 2000, 2000, 2000]);
        assert_eq!(backoff.delay(IpAddr::from([10, 0, 0, 2]), now), Duration::ZERO);
        assert_eq!(backoff.delay(OTHER, now + FORGET_AFTER), Duration::ZERO);
        backoff.succeeded(OTHER);
        assert_eq!(backoff.delay(OTHER, now), Duration::ZERO);
    }

    #[test]
    fn this_machine_has_no_delay() {
        let (now, backoff) = (Instant::now(), Backoff::default());
        let here = IpAddr::from([127, 0, 0, 1]);
        (0..100).for_each(|_| backoff.failed(here, now));
        assert_eq!(backoff.delay(here, now), Duration::ZERO);
    }
}
