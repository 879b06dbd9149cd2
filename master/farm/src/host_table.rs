//! A table with an entry for each host, of bounded size.

use std::collections::BTreeMap;
use std::time::Instant;

/// Most hosts of a table.
const MAX_HOSTS: usize = 1024;

/// Values of hosts, with the time of their last use. Beyond [`MAX_HOSTS`] the entry that was used least recently is dropped.
#[derive(Debug)]
pub(crate) struct HostTable<T> {
    hosts: BTreeMap<u128, (Instant, T)>,
}

impl<T> Default for HostTable<T> {
    fn default() -> Self {
        Self { hosts: BTreeMap::new() }
    }
}

impl<T> HostTable<T> {
    /// The value of a host, if it has one.
    pub(crate) fn get(&self, host: u128) -> Option<&T> {
        self.hosts.get(&host).map(|(_, value)| value)
    }

    /// The value of a host, which is made by `new` where it has none.
    pub(crate) fn entry(&mut self, host: u128, now: Instant, new: impl FnOnce() -> T) -> &mut T {
        if self.hosts.len() >= MAX_HOSTS && !self.hosts.contains_key(&host) {
            let oldest = self.hosts.iter().min_by_key(|(_, (used, _))| *used).map(|(host, _)| *host);
            oldest.iter().for_each(|oldest| drop(self.hosts.remove(oldest)));
        }
        let (used, value) = self.hosts.entry(host).or_insert_with(|| (now, new()));
        *used = now;
        value
    }

    /// Removes the value of a host.
    pub(crate) fn remove(&mut self, host: u128) {
        self.hosts.remove(&host);
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn the_least_recently_used_host_is_dropped_beyond_the_bound() {
        let (start, mut table) = (Instant::now(), HostTable::default());
        for host in 0..MAX_HOSTS as u128 {
            table.entry(host, start + Duration::from_millis(host as u64), || host);
        }
        table.entry(0, start + Duration::from_secs(100), || 0);
        table.entry(5000, start + Duration::from_secs(101), || 5000);
        assert_eq!((table.get(0), table.get(1), table.get(5000)), (Some(&0), None, Some(&5000)));
        assert_eq!(table.hosts.len(), MAX_HOSTS);
        table.remove(5000);
        assert_eq!(table.get(5000), None);
    }
}
