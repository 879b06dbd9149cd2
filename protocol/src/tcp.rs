//! How a TCP connection between a master and a worker is set up, at both of its ends.

use std::io;

use tokio::net::TcpStream;

/// Sends small messages at once: leases and pings must not wait for company. Within one machine it also takes the
/// plainest congestion control.
///
/// # Errors
/// The socket's. A congestion control that cannot be had is not one: it saves time and nothing depends on it.
pub fn configure(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    if is_within_machine(stream) {
        relax_congestion_control(stream);
    }
    Ok(())
}

/// Whether both ends are on this machine.
pub fn is_within_machine(stream: &TcpStream) -> bool {
    let ends = stream.local_addr().and_then(|ours| Ok((ours.ip(), stream.peer_addr()?.ip())));
    ends.is_ok_and(|(ours, theirs)| ours == theirs || theirs.is_loopback())
}

/// Whether a socket that listens on any IPv6 address takes IPv4 connections as well, by this system's default.
pub fn is_dual_stack() -> bool {
    use socket2::{Domain, Socket, Type};
    let socket = Socket::new(Domain::IPV6, Type::STREAM, None);
    socket.and_then(|socket| socket.only_v6()).is_ok_and(|only| !only)
}

/// A loopback is never congested, but a system whose default paces what it sends (BBR) spends timers on it: 3 % of
/// a frame of W1. Every Linux has Reno, and lets everybody use it.
fn relax_congestion_control(stream: &TcpStream) {
    #[cfg(target_os = "linux")]
    let _ = socket2::SockRef::from(stream).set_tcp_congestion(b"reno");
    #[cfg(not(target_os = "linux"))]
    let _ = stream;
}

#[cfg(test)]
mod tests {
    use tokio::net::TcpListener;

    use super::*;

    #[tokio::test]
    async fn both_ends_on_a_loopback_send_at_once_and_unpaced() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let (ours, theirs) = tokio::join!(TcpStream::connect(address), listener.accept());
        for stream in [ours.unwrap(), theirs.unwrap().0] {
            configure(&stream).unwrap();
            assert!(is_within_machine(&stream) && stream.nodelay().unwrap());
            #[cfg(target_os = "linux")]
            assert!(socket2::SockRef::from(&stream).tcp_congestion().unwrap().starts_with(b"reno"));
        }
    }
}
