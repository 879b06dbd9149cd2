//! Addresses to which a worker connects because its master names them.

use std::net::{IpAddr, SocketAddr};

/// First port that a program without privileges uses.
const FIRST_PORT: u16 = 1024;

/// Checks that an address may be that of another worker. `within_machine`: whether the master is on this machine.
///
/// A false master could otherwise make a worker connect to services of its own machine and of its network.
///
/// # Errors
/// The rule that the address breaks.
pub(super) fn check(address: SocketAddr, within_machine: bool) -> Result<(), &'static str> {
    let ip = address.ip().to_canonical();
    if address.port() < FIRST_PORT {
        return Err("a worker does not serve at a port below 1024");
    }
    if ip.is_unspecified() || ip.is_multicast() || ip == IpAddr::from([255; 4]) {
        return Err("the address is not that of one machine");
    }
    if ip.is_loopback() && !within_machine {
        return Err("the address is on this machine, and the master is not");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_of_services_and_addresses_of_several_machines_are_refused() {
        for address in [
            "10.0.0.7:80",
            "10.0.0.7:1023",
            "10.0.0.7:0",
            "0.0.0.0:7200",
            "[::]:7200",
            "[::ffff:0.0.0.0]:7200",
            "224.0.0.251:7200",
            "239.255.255.250:7200",
            "[ff02::fb]:7200",
            "255.255.255.255:7200",
        ] {
            let address = address.parse().unwrap();
            assert!(check(address, false).is_err() && check(address, true).is_err(), "{address}");
        }
        for address in ["10.0.0.7:1024", "203.0.113.9:65535", "[2001:db8::1]:7200", "[fe80::1]:7200"] {
            let address = address.parse().unwrap();
            assert!(check(address, false).is_ok() && check(address, true).is_ok(), "{address}");
        }
    }

    #[test]
    fn loopback_is_accepted_from_a_master_of_this_machine_only() {
        for address in ["127.0.0.1:7200", "127.9.9.9:7200", "[::1]:7200", "[::ffff:127.0.0.1]:7200"] {
            let address = address.parse().unwrap();
            assert!(check(address, true).is_ok() && check(address, false).is_err(), "{address}");
        }
    }
}
