//! Announcement of a master in its local network by multicast DNS (RFC 6762, 6763), for `rayfarm-worker --discover`.
//!
//! It names the address, the port and the hash of the key, and no secret: joining needs the token as well.

use std::net::SocketAddr;

use mdns_sd::{ServiceDaemon, ServiceInfo};
use rayfarm_protocol::transport::KeyHash;

use super::host_name::host_name;

/// Type of the service.
const SERVICE: &str = "_rayfarm._tcp.local.";
/// Longest name of a service instance and of a host label, in bytes (RFC 1035).
const MAX_LABEL_BYTES: usize = 63;

/// A running announcement. Dropping it withdraws it.
pub(super) struct Announcement {
    daemon: ServiceDaemon,
    name: String,
}

impl Announcement {
    /// Announces a master that listens at `address` with this key.
    ///
    /// # Errors
    /// No socket for multicast DNS.
    pub(super) fn start(address: SocketAddr, key: KeyHash) -> Result<Self, mdns_sd::Error> {
        let host = host_name().unwrap_or_else(|| "rayfarm".to_owned());
        let label = rayfarm_text::cut(&host, MAX_LABEL_BYTES - 10);
        // Two masters of one machine have different ports.
        let instance = format!("{label}-{}", address.port());
        let (key, local) = (key.to_string(), format!("{label}.local."));
        let properties = [("v", "1"), ("key", key.as_str()), ("name", host.as_str())];
        let info = match address.ip() {
            ip if ip.is_unspecified() => {
                ServiceInfo::new(SERVICE, &instance, &local, "", address.port(), &properties[..])?
                    .enable_addr_auto()
            }
            ip => ServiceInfo::new(SERVICE, &instance, &local, ip, address.port(), &properties[..])?,
        };
        let daemon = ServiceDaemon::new()?;
        let name = info.get_fullname().to_owned();
        daemon.register(info)?;
        Ok(Self { daemon, name })
    }
}

impl Drop for Announcement {
    fn drop(&mut self) {
        // Both only send a message to the daemon's thread, which may have ended.
        if let Ok(withdrawn) = self.daemon.unregister(&self.name) {
            let _ = withdrawn.recv_timeout(std::time::Duration::from_millis(200));
        }
        let _ = self.daemon.shutdown();
    }
}
