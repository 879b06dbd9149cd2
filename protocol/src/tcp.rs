//! Options of the TCP connections between a master and its workers, set at both ends.

use std::io;

use tokio::net::TcpStream;

/// Disables Nagle's algorithm, so that leases and pings are sent at once. Within one machine it also selects the Reno
/// congestion control.
///
/// # Errors
/// Errors of the socket. A congestion control that is not available is no error: it only saves time.
pub fn configure(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    if is_within_machine(stream) {
        relax_congestion_control(stream);
    }
    Ok(())
}

/// Whether both ends of a connection are on this machine.
pub fn is_within_machine(stream: &TcpStream) -> bool {
    let ends = stream.local_addr().and_then(|ours| Ok((ours.ip(), stream.peer_addr()?.ip())));
    ends.is_ok_and(|(ours, theirs)| ours == theirs || theirs.is_loopback())
}

/// Whether a socket that listens at the unspecified IPv6 address accepts IPv4 connections by this system's default.
pub fn is_dual_stack() -> bool {
    use socket2::{Domain, Socket, Type};
    let socket = Socket::new(Domain::IPV6, Type::STREAM, None);
    socket.and_then(|socket| socket.only_v6()).is_ok_and(|only| !only)
}

/// Selects Reno on Linux, where every user may. A loopback is never congested, but a default that paces its packets (BBR)
/// spends time on timers: 3 % of a frame of a bust of 99,938 triangles.
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
    async fn loopback_connections_have_no_delay_and_no_pacing() {
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
