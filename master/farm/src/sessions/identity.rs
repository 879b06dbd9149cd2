//! The identity of a worker across sessions. Names are not unique: any worker may choose any name.
//!
//! A local worker proves its identity with a *ticket*: a secret that the master passes to that process only, and that it
//! sends as its name. A worker that connects through TLS is identified by its key: a ban holds under each name and at each address.
//! All other workers are identified by name and address. The address also groups workers by host, so that a verification is assigned to a worker of another host.

use std::net::IpAddr;

use blake3::Hash;
use rayfarm_protocol::admission::host_number;
use rayfarm_protocol::transport::KeyHash;
use rayfarm_scheduler::HostId;

/// Identity by which a worker is recognised when it reconnects.
#[derive(Clone, Debug)]
pub(crate) enum Identity {
    /// A process that this master has started: the number of its slot, from 1.
    Local(u32),
    /// Any other worker.
    Remote {
        /// The name that it sends.
        name: String,
        /// The address from which it connects, in canonical form.
        address: IpAddr,
        /// Hash of its public key, where connections use TLS.
        key: Option<KeyHash>,
    },
}

impl PartialEq for Identity {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Local(number), Self::Local(other)) => number == other,
            (Self::Remote { key: Some(key), .. }, Self::Remote { key: Some(other), .. }) => key == other,
            (
                Self::Remote { name, address, key: None },
                Self::Remote { name: other_name, address: other_address, key: None },
            ) => name == other_name && address == other_address,
            _ => false,
        }
    }
}

impl Eq for Identity {}

impl Identity {
    /// Whether this master has started the worker.
    pub(crate) fn is_local(&self) -> bool {
        matches!(self, Self::Local(_))
    }

    /// Whether the worker was not started by this master and connects from the host of that address.
    pub(crate) fn is_of_host(&self, of: IpAddr) -> bool {
        match self {
            Self::Local(_) => false,
            Self::Remote { address, .. } => host(*address) == host(of),
        }
    }

    /// Hash of the public key of a worker that this master has not started, where connections use TLS.
    pub(crate) fn key(&self) -> Option<KeyHash> {
        match self {
            Self::Local(_) => None,
            Self::Remote { key, .. } => *key,
        }
    }

    /// The name to display.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Local(number) => local_name(*number),
            Self::Remote { name, .. } => name.clone(),
        }
    }
}

/// The displayed name of the local worker in slot `number`.
pub(crate) fn local_name(number: u32) -> String {
    format!("local-{number}")
}

/// The tickets of all local workers. Without random numbers there are none, and local workers are identified as remote
/// ones are.
#[derive(Debug, Default)]
pub(crate) struct Tickets(Vec<Hash>);

impl Tickets {
    /// Tickets for the slots 1 to `count`: hashes with a secret key of this master.
    pub(crate) fn new(secret: Option<&[u8; 32]>, count: u32) -> Self {
        let ticket = |secret, number: u32| {
            let mut hasher = blake3::Hasher::new_keyed(secret);
            hasher.update(b"ticket of local worker ").update(&number.to_le_bytes()).finalize()
        };
        Self(secret.into_iter().flat_map(|secret| (1..=count).map(move |n| ticket(secret, n))).collect())
    }

    /// The ticket of a slot, in hexadecimal.
    pub(crate) fn of(&self, number: u32) -> Option<String> {
        let hash = self.0.get(number.checked_sub(1)? as usize)?;
        Some(hash.to_hex().to_string())
    }

    /// The identity of a worker that sends this name from this address, with this key. Tickets are compared in constant time.
    pub(crate) fn identify(&self, name: &str, address: IpAddr, key: Option<KeyHash>) -> Identity {
        let sent = Hash::from_hex(name).ok();
        let slot = sent.and_then(|sent| (1..).zip(&self.0).find(|(_, ticket)| **ticket == sent));
        match slot {
            Some((number, _)) => Identity::Local(number),
            None => Identity::Remote { name: name.to_owned(), address: address.to_canonical(), key },
        }
    }
}

/// The host of an address, so that a verification is assigned to a worker of another host.
pub(crate) fn host(address: IpAddr) -> HostId {
    HostId(host_number(address))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ticket_identifies_its_slot_and_a_name_identifies_none() {
        let here = IpAddr::from([127, 0, 0, 1]);
        let tickets = Tickets::new(Some(&[7; 32]), 2);
        for number in [1, 2] {
            let ticket = tickets.of(number).unwrap();
            assert_eq!(tickets.identify(&ticket, here, None), Identity::Local(number));
            assert_eq!(Identity::Local(number).name(), format!("local-{number}"));
            let remote = Identity::Remote { name: ticket.clone(), address: here, key: None };
            assert_eq!(Tickets::new(Some(&[8; 32]), 2).identify(&ticket, here, None), remote);
        }
        assert_eq!((tickets.of(0), tickets.of(3), Tickets::new(None, 2).of(1)), (None, None, None));
        let mapped = "::ffff:127.0.0.1".parse().unwrap();
        let named = Identity::Remote { name: "local-1".into(), address: here, key: None };
        assert_eq!(tickets.identify("local-1", mapped, None), named);
    }

    #[test]
    fn a_key_is_an_identity_under_each_name_and_address() {
        let of = |name: &str, host: u8, key: Option<u8>| {
            let key = key.map(|byte| KeyHash([byte; 32]));
            Tickets::default().identify(name, IpAddr::from([10, 0, 0, host]), key)
        };
        assert_eq!(of("a", 1, Some(1)), of("b", 2, Some(1)));
        assert_ne!(of("a", 1, Some(1)), of("a", 1, Some(2)), "two workers of one name on one machine");
        assert_ne!(of("a", 1, Some(1)), of("a", 1, None));
        assert_eq!(of("a", 1, None), of("a", 1, None));
        assert_ne!(of("a", 1, None), of("a", 2, None));
    }
}
