//! What to do about a failed connection or handshake.

use std::io::ErrorKind;

use rayfarm_protocol::ProtocolError;

/// Advice about a connection that was not accepted.
pub(super) fn of_connect(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::ConnectionRefused => {
            "no program listens there: start the master, with --listen at an address that this machine reaches"
        }
        ErrorKind::TimedOut => "open the port in the firewall of the master's machine, and check the address",
        _ => "check the network between the machines (ping), and the address",
    }
}

/// The check that a failed handshake belongs to, and advice.
pub(super) fn of_handshake(error: &ProtocolError) -> (&'static str, &'static str) {
    match error {
        ProtocolError::Version { .. } => ("version", "install the same release of rayfarm on both machines"),
        ProtocolError::NotRayfarm { .. } | ProtocolError::SameRole { .. } => {
            ("version", "another program listens at that port: check address and port")
        }
        ProtocolError::Transport { .. } => (
            "key and token",
            "use --join with the line that the master prints, or --master for one with --insecure",
        ),
        ProtocolError::WrongKey { .. } | ProtocolError::WrongToken | ProtocolError::Tls { .. } => {
            ("key and token", "copy the join line that the master prints now")
        }
        ProtocolError::Refused { .. } => {
            ("key and token", "follow the master's reason; copy the join line that it prints now")
        }
        ProtocolError::NotNow { .. } => {
            ("session", "try again later: the master accepts no more workers now")
        }
        _ => ("session", "try again; look into the master's log if it fails again"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_are_attributed_to_their_checks() {
        assert_eq!(of_handshake(&ProtocolError::WrongToken).0, "key and token");
        let busy = ProtocolError::NotNow { reason: "full".to_owned() };
        assert_eq!(of_handshake(&busy).0, "session");
        assert!(of_connect(ErrorKind::ConnectionRefused).contains("--listen"));
        assert!(of_connect(ErrorKind::TimedOut).contains("firewall"));
    }
}
