//! The host of an address.

use std::net::IpAddr;

/// Number of the host of an address. All loopback addresses are one host, and so is each IPv6 network of 64 bits, because
/// one machine may use any number of addresses in it.
pub fn host_number(address: IpAddr) -> u128 {
    let address = address.to_canonical();
    match address {
        _ if address.is_loopback() => 1,
        IpAddr::V4(v4) => v4.to_ipv6_mapped().to_bits(),
        IpAddr::V6(v6) => v6.to_bits() >> 64 << 64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_of_one_machine_belong_to_one_host() {
        let of = |text: &str| host_number(text.parse().unwrap());
        for (one, same) in [
            ("127.0.0.1", "127.9.9.9"),
            ("127.0.0.1", "::1"),
            ("10.0.0.7", "::ffff:10.0.0.7"),
            ("2001:db8:1:2::1", "2001:db8:1:2:ffff::9"),
        ] {
            assert_eq!(of(one), of(same));
        }
        for (one, other) in
            [("10.0.0.7", "10.0.0.8"), ("127.0.0.1", "10.0.0.1"), ("2001:db8::1", "2001:db8:0:1::1")]
        {
            assert_ne!(of(one), of(other));
        }
    }
}
