//! Socket addresses as text, with the name of an interface as the scope of a link-local address
//! (`[fe80::1%eth0]:7117`), and the addresses of this machine.

use std::io;
use std::net::{IpAddr, Ipv6Addr, SocketAddr, SocketAddrV6};

/// An address of this machine, with its network interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    /// Name of the interface, such as `eth0`.
    pub name: String,
    /// Number of the interface, which is the scope of a link-local address; 0 where it is unknown.
    pub index: u32,
    /// One address of the interface.
    pub ip: IpAddr,
    /// Whether the interface is connected, as far as the system reports it.
    pub is_up: bool,
}

/// Lists the addresses of this machine, one entry per address.
///
/// # Errors
/// Errors of the system.
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

/// Parses `ADDR:PORT` with a numeric address. Returns `None` for any other text, such as one with a host name.
///
/// # Errors
/// A scope that is no interface of this machine. The message lists the interfaces.
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

/// Resolves `HOST:PORT`. A link-local address may have the name of an interface as its scope.
///
/// # Errors
/// Errors of the resolver; a scope that is no interface of this machine.
pub async fn resolve(text: &str) -> io::Result<Vec<SocketAddr>> {
    match parse(text) {
        Ok(Some(address)) => Ok(vec![address]),
        Ok(None) => Ok(tokio::net::lookup_host(text).await?.collect()),
        Err(problem) => Err(io::Error::new(io::ErrorKind::AddrNotAvailable, problem)),
    }
}

/// Formats an address as [`parse`] reads it, with the name of the interface as its scope where `interfaces` has it.
pub fn show(address: SocketAddr, interfaces: &[Interface]) -> String {
    let SocketAddr::V6(v6) = address else { return address.to_string() };
    let name = |scope: u32| interfaces.iter().find(|interface| scope > 0 && interface.index == scope);
    match name(v6.scope_id()) {
        Some(interface) => format!("[{}%{}]:{}", v6.ip(), interface.name, v6.port()),
        None => address.to_string(),
    }
}

/// Splits `[fe80::1%eth0]:7117` into address, scope and port.
fn split_scoped(text: &str) -> Option<(Ipv6Addr, &str, u16)> {
    let (inside, port) = text.strip_prefix('[')?.rsplit_once("]:")?;
    let (ip, scope) = inside.split_once('%')?;
    Some((ip.parse().ok()?, scope, port.parse().ok()?))
}

/// Lists the names of interfaces for an error message, each once.
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

    /// The loopback interface of this machine.
    fn loopback() -> Interface {
        let found = interfaces().unwrap().into_iter().find(|interface| interface.ip.is_loopback());
        found.unwrap()
    }

    #[test]
    fn numeric_addresses_are_parsed_and_host_names_are_not() {
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
    fn addresses_without_a_known_scope_are_formatted_unchanged() {
        for text in ["127.0.0.1:7117", "[2001:db8::1]:7117", "[fe80::1%4294967295]:7117"] {
            assert_eq!(show(text.parse().unwrap(), &[loopback()]), text);
        }
    }

    #[tokio::test]
    async fn scoped_addresses_are_resolved() {
        let loopback = loopback();
        let resolved = resolve(&format!("[fe80::1%{}]:7117", loopback.name)).await.unwrap();
        assert_eq!(resolved, [SocketAddrV6::new("fe80::1".parse().unwrap(), 7117, 0, loopback.index).into()]);
        assert!(resolve("127.0.0.1:7117").await.unwrap().contains(&"127.0.0.1:7117".parse().unwrap()));
        let error = resolve("[fe80::1%nothere0]:7117").await.unwrap_err();
        assert!(error.to_string().contains("no interface"), "{error}");
    }
}
