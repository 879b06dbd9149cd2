//! The addresses under which workers reach this master, for the window and the log.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV6, UdpSocket};

use rayfarm_protocol::address::{self, Interface};
use rayfarm_protocol::transport::MasterSecurity;

/// Addresses that the window shows.
const SHOWN: usize = 2;

/// Longest part of a command in the window, in characters.
const WINDOW_COLUMNS: usize = 64;

/// Where and how workers connect to a master.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entrance {
    /// The address at which the master listens.
    pub address: SocketAddr,
    /// Whether connections use TLS, with which key and token.
    pub security: MasterSecurity,
}

impl Entrance {
    /// The addresses under which workers may connect now, with the command that starts one.
    pub fn reachable(&self) -> Reachable {
        Reachable { security: self.security.clone(), ..Reachable::of(self.address) }
    }
}

/// The addresses under which workers may connect, best first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reachable {
    /// Values for a worker's `--master`; never empty.
    pub addresses: Vec<String>,
    /// Whether other machines can use them.
    pub from_outside: bool,
    /// Whether the listening address is meant for other machines.
    pub meant_for_outside: bool,
    /// Whether workers need a join line.
    security: MasterSecurity,
}

impl Reachable {
    /// The addresses of a master that listens at `listening`. An unspecified address means all addresses of this
    /// machine, which are read from the operating system.
    pub fn of(listening: SocketAddr) -> Self {
        let interfaces = address::interfaces().unwrap_or_else(|error| {
            tracing::debug!("cannot list this machine's addresses: {error}");
            Vec::new()
        });
        Self::among(listening, &interfaces, default_route(listening.is_ipv6()))
    }

    /// As [`Self::of`], with given interfaces; `routed`: the local address of the default route, if there is one.
    fn among(listening: SocketAddr, interfaces: &[Interface], routed: Option<IpAddr>) -> Self {
        let ip = listening.ip();
        if !ip.is_unspecified() {
            let outside = !ip.is_loopback();
            let addresses = vec![address::show(listening, interfaces)];
            let security = MasterSecurity::Plain;
            return Self { addresses, from_outside: outside, meant_for_outside: outside, security };
        }
        let fits = |interface: &&Interface| {
            let is_here_only = interface.ip.is_loopback() || interface.ip.is_unspecified();
            // A socket for any IPv6 address accepts IPv4 connections as well on most systems.
            interface.is_up && !is_here_only && (interface.ip.is_ipv4() || listening.is_ipv6())
        };
        let mut found: Vec<&Interface> = interfaces.iter().filter(fits).collect();
        found.retain(|interface| interface.ip.is_ipv6() || listening.is_ipv4() || is_dual_stack());
        found.sort_by_key(|interface| (rank(interface, routed), interface.index));
        found.dedup();
        let shown = |interface: &&Interface| address::show(at(interface, listening.port()), interfaces);
        let mut addresses: Vec<String> = found.iter().map(shown).collect();
        let from_outside = !addresses.is_empty();
        if !from_outside {
            let loopback: IpAddr =
                if ip.is_ipv6() { Ipv6Addr::LOCALHOST.into() } else { Ipv4Addr::LOCALHOST.into() };
            addresses.push(SocketAddr::new(loopback, listening.port()).to_string());
        }
        Self { addresses, from_outside, meant_for_outside: true, security: MasterSecurity::Plain }
    }

    /// The command line that starts a worker. With TLS it contains the farm's token: it belongs in no log.
    pub fn command(&self) -> String {
        self.command_at(self.addresses.first().map_or("", String::as_str))
    }

    /// The command lines that start a worker, one for each address: see [`Self::command`].
    pub fn commands(&self) -> Vec<String> {
        self.addresses.iter().map(|address| self.command_at(address)).collect()
    }

    fn command_at(&self, address: &str) -> String {
        match &self.security {
            MasterSecurity::Plain => format!("rayfarm-worker --master {address}"),
            MasterSecurity::Tls(trust) => format!("rayfarm-worker --join {}", trust.join_line(address)),
        }
    }

    /// Whether workers need a join line, which is a secret.
    pub fn is_secret(&self) -> bool {
        matches!(self.security, MasterSecurity::Tls(_))
    }

    /// Lines for the window that say how to start a worker, with at most two addresses. Long commands are divided.
    pub fn for_window(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.meant_for_outside && !self.from_outside {
            lines.push("This machine has no address that others can reach.".to_owned());
        }
        lines.push(format!("To start one {}:", self.place()));
        let shown = if self.is_secret() { 1 } else { SHOWN };
        for command in self.commands().into_iter().take(shown) {
            let letters: Vec<char> = command.chars().collect();
            lines.extend(letters.chunks(WINDOW_COLUMNS).map(|part| part.iter().collect::<String>()));
        }
        lines
    }

    /// One line for the log that says how to start a worker, with all addresses. It contains no secret.
    pub fn for_log(&self) -> String {
        if self.is_secret() {
            let addresses = self.addresses.join(", ");
            let (place, warning) = (self.place(), self.warning());
            return format!(
                "to start one {place}, paste the line that `rayfarm-master trust show` prints; \
                 it connects to {addresses}{warning}"
            );
        }
        let others = match self.addresses.get(1..) {
            None | Some([]) => String::new(),
            Some(others) => format!(" (or at {})", others.join(", ")),
        };
        format!("to start one {}: {}{others}{}", self.place(), self.command(), self.warning())
    }

    /// One line for the log that says where workers connect, if the address is meant for other machines.
    pub fn announcement(&self) -> Option<String> {
        let list = || format!("workers connect to {}{}", self.addresses.join(", "), self.warning());
        self.meant_for_outside.then(list)
    }

    fn place(&self) -> &'static str {
        if self.from_outside { "on any machine" } else { "on this machine" }
    }

    fn warning(&self) -> &'static str {
        match self.meant_for_outside && !self.from_outside {
            true => "; this machine has no address that others can reach: is it connected to a network?",
            false => "",
        }
    }
}

/// Adds the interface to a link-local address, which is ambiguous without it.
fn at(interface: &Interface, port: u16) -> SocketAddr {
    match interface.ip {
        IpAddr::V6(ip) if ip.is_unicast_link_local() => {
            SocketAddrV6::new(ip, port, 0, interface.index).into()
        }
        ip => SocketAddr::new(ip, port),
    }
}

/// A rank of addresses by how likely other machines of the room can reach them: lower is better.
fn rank(interface: &Interface, routed: Option<IpAddr>) -> u8 {
    let kind = match interface.ip {
        IpAddr::V4(ip) if ip.is_private() => 1,
        IpAddr::V6(ip) if ip.is_unique_local() => 3,
        IpAddr::V4(ip) if ip.is_link_local() => 6,
        IpAddr::V6(ip) if ip.is_unicast_link_local() => 7,
        IpAddr::V4(_) => 2,
        IpAddr::V6(_) => 4,
    };
    match () {
        () if is_inside_a_machine(&interface.name) => 10 + kind,
        () if routed == Some(interface.ip) => 0,
        () => kind,
    }
}

/// Whether an interface of that name connects only containers and virtual machines of this machine.
fn is_inside_a_machine(name: &str) -> bool {
    const PREFIXES: [&str; 9] =
        ["docker", "br-", "veth", "virbr", "vmnet", "vboxnet", "lxc", "cni", "podman"];
    PREFIXES.iter().any(|prefix| name.starts_with(prefix))
}

/// Whether a socket for any IPv6 address also accepts IPv4 connections on this system.
fn is_dual_stack() -> bool {
    rayfarm_protocol::tcp::is_dual_stack()
}

/// The local address of the default route. Connecting a datagram socket only consults the routing table; nothing is
/// sent.
fn default_route(ipv6: bool) -> Option<IpAddr> {
    // Addresses reserved for documentation: RFC 5737 and RFC 3849.
    let ask = |any: IpAddr, outside: IpAddr| {
        let socket = UdpSocket::bind((any, 0)).ok()?;
        socket.connect((outside, 9)).ok()?;
        Some(socket.local_addr().ok()?.ip())
    };
    let v4 = ask(Ipv4Addr::UNSPECIFIED.into(), Ipv4Addr::new(192, 0, 2, 1).into());
    let v6 = || ask(Ipv6Addr::UNSPECIFIED.into(), Ipv6Addr::new(0x2001, 0xdb8, 0, 0, 0, 0, 0, 1).into());
    v4.or_else(|| if ipv6 { v6() } else { None })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interface(index: u32, name: &str, ip: &str) -> Interface {
        Interface { name: name.to_owned(), index, ip: ip.parse().unwrap(), is_up: true }
    }

    fn machine() -> Vec<Interface> {
        vec![
            interface(1, "lo", "127.0.0.1"),
            interface(1, "lo", "::1"),
            interface(2, "eth0", "fe80::2"),
            interface(2, "eth0", "2001:db8::2"),
            interface(2, "eth0", "fd00::2"),
            interface(2, "eth0", "192.168.1.10"),
            interface(3, "wlan0", "10.0.0.3"),
            interface(4, "docker0", "172.17.0.1"),
            interface(5, "ppp0", "203.0.113.5"),
            interface(6, "usb0", "169.254.1.1"),
            Interface { is_up: false, ..interface(7, "eth1", "192.168.7.7") },
        ]
    }

    fn found(listening: &str, interfaces: &[Interface], routed: Option<&str>) -> Reachable {
        let routed = routed.map(|routed| routed.parse().unwrap());
        Reachable::among(listening.parse().unwrap(), interfaces, routed)
    }

    #[test]
    fn private_addresses_come_first_and_loopback_is_left_out() {
        let reachable = found("0.0.0.0:7117", &machine(), None);
        let expected =
            ["192.168.1.10:7117", "10.0.0.3:7117", "203.0.113.5:7117", "169.254.1.1:7117", "172.17.0.1:7117"];
        assert_eq!(reachable.addresses, expected);
        assert_eq!(
            reachable.for_window(),
            [
                "To start one on any machine:",
                "rayfarm-worker --master 192.168.1.10:7117",
                "rayfarm-worker --master 10.0.0.3:7117"
            ]
        );
        let log = reachable.for_log();
        assert!(
            log.starts_with(
                "to start one on any machine: rayfarm-worker --master 192.168.1.10:7117 (or at 10"
            )
        );
        assert!(expected.iter().all(|address| log.contains(address)), "{log}");
    }

    #[test]
    fn the_interface_with_the_default_route_is_the_best() {
        let reachable = found("0.0.0.0:7117", &machine(), Some("10.0.0.3"));
        assert_eq!(reachable.addresses[..2], ["10.0.0.3:7117", "192.168.1.10:7117"]);
    }

    #[test]
    fn ipv6_addresses_are_listed_and_link_local_ones_have_a_scope() {
        let reachable = found("[::]:7117", &machine(), None);
        let v6: Vec<_> = reachable.addresses.iter().filter(|address| address.starts_with('[')).collect();
        assert_eq!(v6, ["[fd00::2]:7117", "[2001:db8::2]:7117", "[fe80::2%eth0]:7117"]);
        let v4 = reachable.addresses.iter().any(|address| address == "192.168.1.10:7117");
        assert_eq!(v4, is_dual_stack());
    }

    #[test]
    fn a_machine_without_a_network_gets_a_warning() {
        for (listening, loopback) in [("0.0.0.0:7117", "127.0.0.1:7117"), ("[::]:7117", "[::1]:7117")] {
            let reachable = found(listening, &machine()[..2], None);
            assert_eq!(reachable.addresses, [loopback]);
            let window = reachable.for_window();
            assert_eq!(window[0], "This machine has no address that others can reach.");
            assert_eq!(
                window[1..],
                ["To start one on this machine:".to_owned(), format!("rayfarm-worker --master {loopback}")]
            );
            assert!(reachable.for_log().contains("no address that others can reach"));
            assert!(reachable.announcement().unwrap().contains("no address that others can reach"));
        }
    }

    #[test]
    fn an_explicit_address_is_listed_unchanged() {
        for (listening, place) in [
            ("127.0.0.1:7117", "on this machine"),
            ("192.168.1.10:7117", "on any machine"),
            ("[::1]:7117", "on this machine"),
        ] {
            let reachable = found(listening, &machine(), None);
            assert_eq!(reachable.addresses, [listening]);
            assert!(reachable.for_log().starts_with(&format!("to start one {place}:")));
        }
        assert_eq!(found("127.0.0.1:7117", &machine(), None).announcement(), None);
        assert_eq!(found("[fe80::2%2]:7117", &machine(), None).addresses, ["[fe80::2%eth0]:7117"]);
    }

    #[test]
    fn loopback_is_not_offered_to_other_machines() {
        for listening in ["0.0.0.0:7117", "[::]:7117"] {
            let reachable = Reachable::of(listening.parse().unwrap());
            let loopback = |address: &String| address.starts_with("127.") || address.starts_with("[::1]");
            assert_eq!(reachable.addresses.iter().any(loopback), !reachable.from_outside, "{reachable:?}");
        }
    }

    #[test]
    fn the_token_is_in_the_command_and_in_no_line_of_the_log() {
        use std::sync::Arc;

        use rayfarm_protocol::transport::{JoinToken, MasterTrust, PrivateKey};
        let token = JoinToken([0xA5; 16]);
        let trust = Arc::new(MasterTrust::new(PrivateKey::generate().unwrap(), token));
        let listening = "192.0.2.7:7117".parse().unwrap();
        let entrance = Entrance { address: listening, security: MasterSecurity::Tls(trust.clone()) };
        let reachable = entrance.reachable();
        assert!(reachable.is_secret());
        let line = trust.join_line("192.0.2.7:7117").to_string();
        assert_eq!(reachable.commands(), [format!("rayfarm-worker --join {line}")]);
        assert_eq!(reachable.for_window()[1..].concat(), reachable.command(), "divided, and complete");
        assert!(!reachable.for_log().contains(&token.to_string()));
        assert!(!reachable.announcement().unwrap().contains(&token.to_string()));
    }
}
