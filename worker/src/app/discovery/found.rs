//! A master that answered a search, with its texts checked.

use std::fmt;
#[cfg(any(test, feature = "discovery"))]
use std::net::IpAddr;

use rayfarm_protocol::transport::KeyHash;
#[cfg(any(test, feature = "discovery"))]
use rayfarm_text::printable_within;

/// Version of the announcement in its TXT record.
#[cfg(any(test, feature = "discovery"))]
const VERSION: &str = "1";

/// Longest name that is displayed, in bytes.
#[cfg(any(test, feature = "discovery"))]
const MAX_NAME_BYTES: usize = 64;

/// A master that answered a search. Nothing of it is authenticated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct FoundMaster {
    /// Name, printable.
    pub(super) name: String,
    /// Address as HOST:PORT.
    pub(super) address: String,
    /// Hash of the master's public key.
    pub(super) key: KeyHash,
}

impl fmt::Display for FoundMaster {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<24} {:<32} key {}", self.name, self.address, self.key.short())
    }
}

#[cfg(any(test, feature = "discovery"))]
impl FoundMaster {
    /// Reads an announcement: the values of its TXT record, its port, and its addresses with their texts (which include
    /// the scope of a link-local address). Returns `None` where it is malformed or of another version.
    pub(super) fn of_announcement<'a>(
        value: impl Fn(&str) -> Option<&'a str>,
        port: u16,
        addresses: impl Iterator<Item = (IpAddr, String)>,
    ) -> Option<Self> {
        if value("v")? != VERSION || port == 0 {
            return None;
        }
        let key = value("key")?.parse().ok()?;
        let (ip, text) = addresses.min_by_key(|(ip, text)| (rank(ip), text.clone()))?;
        let address = if ip.is_ipv6() { format!("[{text}]:{port}") } else { format!("{text}:{port}") };
        let name = value("name").map(str::trim).filter(|name| !name.is_empty()).unwrap_or("unnamed");
        Some(Self { name: printable_within(name, MAX_NAME_BYTES).into_owned(), address, key })
    }
}

/// Order of preference of an address: IPv4 first, then IPv6, link-local and loopback addresses last.
#[cfg(any(test, feature = "discovery"))]
fn rank(ip: &IpAddr) -> u8 {
    match ip {
        ip if ip.is_loopback() => 4,
        IpAddr::V4(v4) if v4.is_link_local() => 2,
        IpAddr::V4(_) => 0,
        IpAddr::V6(v6) if v6.is_unicast_link_local() => 3,
        IpAddr::V6(_) => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(values: &[(&str, &str)], port: u16, addresses: &[&str]) -> Option<FoundMaster> {
        let value = |name: &str| values.iter().find(|(known, _)| *known == name).map(|(_, value)| *value);
        let addresses = addresses.iter().map(|text| {
            let ip = text.split('%').next().unwrap().parse().unwrap();
            (ip, (*text).to_owned())
        });
        FoundMaster::of_announcement(value, port, addresses)
    }

    #[test]
    fn the_address_that_is_reached_most_likely_is_chosen() {
        let key = "5a".repeat(32);
        let values = [("v", "1"), ("key", key.as_str()), ("name", "attic")];
        for (addresses, expected) in [
            (&["127.0.0.1", "fe80::1%eth0", "10.0.0.2", "fd00::2"][..], "10.0.0.2:7117"),
            (&["127.0.0.1", "fe80::1%eth0", "fd00::2"], "[fd00::2]:7117"),
            (&["::1", "fe80::1%eth0"], "[fe80::1%eth0]:7117"),
        ] {
            let master = read(&values, 7117, addresses).unwrap();
            assert_eq!((master.address.as_str(), master.name.as_str()), (expected, "attic"));
        }
        assert_eq!(read(&values, 7117, &[]), None);
        assert_eq!(read(&values, 0, &["10.0.0.2"]), None);
    }

    #[test]
    fn malformed_announcements_are_ignored_and_names_are_made_printable() {
        let key = "5a".repeat(32);
        let key = key.as_str();
        let long = "x".repeat(5000);
        for values in [
            &[("key", key)][..],
            &[("v", "2"), ("key", key)],
            &[("v", "1")],
            &[("v", "1"), ("key", "5a")],
            &[("v", "1"), ("key", &long)],
        ] {
            assert_eq!(read(values, 1, &["10.0.0.2"]), None, "{values:?}");
        }
        for name in ["\u{1b}[2Jevil\n", &long, ""] {
            let master = read(&[("v", "1"), ("key", key), ("name", name)], 1, &["10.0.0.2"]).unwrap();
            let shown = master.to_string();
            assert!(!shown.contains(char::is_control) && shown.len() < 200, "{shown:?}");
        }
    }
}
