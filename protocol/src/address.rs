//! Addresses as people write them, link-local ones with the name of an interface included (`[fe80::1%eth0]:7117`), and
//! the addresses of this machine.

use std::io;
use std::net::{IpAddr, Ipv6Addr, SocketAddr, SocketAddrV6};

/// An address of this machine, and the interface that has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    /// The interface's name, such as `eth0`.
    pub name: String,
    /// Its number, which is the scope of a link-local address.
    pub index: u32,
    /// One of its addresses.
    pub ip: IpAddr,
    /// Whether it is connected to anything, as far as the system knows.
    pub is_up: bool,
}

/// Lists the addresses of this machine, one entry for each.
///
/// # Errors
/// The system's.
pub fn interfaces() -> io::Result<Vec<Interface>> {
    let found = if_addrs::get_if_addrs()?.into_iter().map(|interface| Interface {
        ip: interface.ip(),
        index: interface.index.unwrap_or_default(),
        is_up: !matches!(
            interface.oper_status,
            if_addrs::IfOperStatus::Down
                | if_addrs::IfOperStatus::NotPresent
                | if_addrs::IfOperStatus::LowerLayerDown
        ),
        name: interface.name,
    });
    Ok(found.collect())
}

/// Reads `ADDR:PORT` with the address in digits; `None` where it is no such address (it may hold a host's name).
///
/// # Errors
/// A scope that is no interface of this machine, with those that are.
pub fn parse(text: &str) -> Result<Option<SocketAddr>, String> {
    if let Ok(address) = text.parse() {
        return Ok(Some(address));
    }
    let Some((ip, scope, port)) = split_scoped(text) else { return Ok(None) };
    let interfaces =
        interfaces().map_err(|error| format!("cannot list this machine's interfaces: {error}"))?;
    match interfaces.iter().find(|interface| interface.name == scope && interface.index > 0) {
        Some(interface) => Ok(Some(SocketAddrV6::new(ip, port, 0, interface.index).into())),
        None => Err(format!("this machine has no interface {scope:?}; it has {}", names(&interfaces))),
    }
}

/// Looks up `HOST:PORT`; a link-local address may have an interface's name as its scope.
///
/// # Errors
/// The resolver's, or a scope that is no interface of this machine.
pub async fn resolve(text: &str) -> io::Result<Vec<SocketAddr>> {
    match parse(text) {
        Ok(Some(address)) => Ok(vec![address]),
        Ok(None) => Ok(tokio::net::lookup_host(text).await?.collect()),
        Err(problem) => Err(io::Error::new(io::ErrorKind::AddrNotAvailable, problem)),
    }
}

/// An address as [`parse`] reads it, the scope of a link-local one as the interface's name where that is known.
pub fn show(address: SocketAddr, interfaces: &[Interface]) -> String {
    let SocketAddr::V6(v6) = address else { return address.to_string() };
    let name = |scope: u32| interfaces.iter().find(|interface| scope > 0 && interface.index == scope);
    match name(v6.scope_id()) {
        Some(interface) => format!("[{}%{}]:{}", v6.ip(), interface.name, v6.port()),
        None => address.to_string(),
    }
}

/// `[fe80::1%eth0]:7117` as its three parts.
fn split_scoped(text: &str) -> Option<(Ipv6Addr, &str, u16)> {
    let (inside, port) = text.strip_prefix('[')?.rsplit_once("]:")?;
    let (ip, scope) = inside.split_once('%')?;
    Some((ip.parse().ok()?, scope, port.parse().ok()?))
}

/// The names of interfaces, each once, for people.
fn names(interfaces: &[Interface]) -> String {
    let mut names: Vec<&str> = interfaces.iter().map(|interface| interface.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    match names.as_slice() {
        [] => "none with an address".to_owned(),
        names => names.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The loopback interface of this machine, which every machine has.
    fn loopback() -> Interface {
        let found = interfaces().unwrap().into_iter().find(|interface| interface.ip.is_loopback());
        found.unwrap()
    }

    #[test]
    fn addresses_in_digits_are_read_and_names_are_left_to_the_resolver() {
        for text in ["127.0.0.1:7117", "[::1]:7117", "[fe80::1%3]:7117", "0.0.0.0:0"] {
            assert_eq!(parse(text), Ok(Some(text.parse().unwrap())), "{text}");
        }
        for text in
            ["farm:7117", "[fe80::1%eth0]", "fe80::1%eth0:7117", "[farm%eth0]:7117", "[::1%lo]:99999", ""]
        {
            assert_eq!(parse(text), Ok(None), "{text}");
        }
    }

    #[test]
    fn a_scope_is_the_name_of_an_interface() {
        let loopback = loopback();
        let address = parse(&format!("[fe80::1%{}]:7117", loopback.name)).unwrap().unwrap();
        let expected = SocketAddrV6::new("fe80::1".parse().unwrap(), 7117, 0, loopback.index);
        assert_eq!(address, expected.into());
        assert_eq!(
            show(address, std::slice::from_ref(&loopback)),
            format!("[fe80::1%{}]:7117", loopback.name)
        );
        let problem = parse("[fe80::1%nothere0]:7117").unwrap_err();
        assert!(problem.contains("\"nothere0\"") && problem.contains(&loopback.name), "{problem}");
    }

    #[test]
    fn other_addresses_are_shown_as_they_are() {
        for text in ["127.0.0.1:7117", "[2001:db8::1]:7117", "[fe80::1%4294967295]:7117"] {
            assert_eq!(show(text.parse().unwrap(), &[loopback()]), text);
        }
    }

    #[tokio::test]
    async fn a_scoped_address_is_resolved_like_any_other() {
        let loopback = loopback();
        let resolved = resolve(&format!("[fe80::1%{}]:7117", loopback.name)).await.unwrap();
        assert_eq!(resolved, [SocketAddrV6::new("fe80::1".parse().unwrap(), 7117, 0, loopback.index).into()]);
        assert!(resolve("127.0.0.1:7117").await.unwrap().contains(&"127.0.0.1:7117".parse().unwrap()));
        let error = resolve("[fe80::1%nothere0]:7117").await.unwrap_err();
        assert!(error.to_string().contains("no interface"), "{error}");
    }
}
