//! Search for masters by mDNS (RFC 6762, RFC 6763).

use std::time::{Duration, Instant};

use mdns_sd::{ServiceDaemon, ServiceEvent};

use super::found::FoundMaster;

/// Type of the service that masters announce.
const SERVICE: &str = "_rayfarm._tcp.local.";

/// Duration of a search.
const SEARCH_TIME: Duration = Duration::from_secs(3);

/// Most masters of a search. Further answers are ignored.
const MAX_FOUND: usize = 32;

/// Most addresses of an answer that are compared.
const MAX_ADDRESSES: usize = 16;

/// Lists the masters that answer within 3 s, by their names, one for each key.
///
/// # Errors
/// A network without multicast.
pub(super) fn search() -> Result<Vec<FoundMaster>, String> {
    let failed = |error: mdns_sd::Error| format!("cannot search the network: {error}");
    let daemon = ServiceDaemon::new().map_err(failed)?;
    let events = daemon.browse(SERVICE).map_err(failed)?;
    let end = Instant::now() + SEARCH_TIME;
    let mut found: Vec<FoundMaster> = Vec::new();
    while let Ok(event) = events.recv_deadline(end) {
        let ServiceEvent::ServiceResolved(service) = event else { continue };
        let addresses = service.addresses.iter().take(MAX_ADDRESSES);
        let addresses = addresses.map(|address| (address.to_ip_addr(), address.to_string()));
        let value = |name: &str| service.get_property_val_str(name);
        if let Some(master) = FoundMaster::of_announcement(value, service.port, addresses)
            && found.len() < MAX_FOUND
            && found.iter().all(|known| known.key != master.key)
        {
            found.push(master);
        }
        if Instant::now() >= end {
            break;
        }
    }
    // Its thread ends later; the search is complete.
    let _ = daemon.shutdown();
    found.sort_by(|a, b| (&a.name, &a.address).cmp(&(&b.name, &b.address)));
    Ok(found)
}
