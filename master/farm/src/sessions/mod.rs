//! The sessions of connected workers: senders, granted leases, bans and byte counts.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;

use rayfarm_protocol::{AssetId, KeyHash, ToWorker};
use rayfarm_scheduler::{Reconnect, WorkerId};
use tokio::task::JoinHandle;

pub(crate) mod addresses;
mod bans;
pub(crate) mod budget;
mod byte_count;
pub(crate) mod causes;
pub(crate) mod identity;
pub(crate) mod lease_book;
mod session;

use crate::assets::routing::{AssetRouting, AssetSource};
use bans::Bans;
use identity::Identity;

pub(crate) use bans::PastWorker;
pub(crate) use byte_count::ByteCount;
pub(crate) use session::{Link, Session};

/// Workers whose failures an error message lists.
const MAX_LISTED_FAILURES: usize = 4;

/// All current sessions, by worker.
#[derive(Default)]
pub(crate) struct Sessions {
    sessions: BTreeMap<WorkerId, Session>,
    /// Traffic of sessions that have ended.
    ended: ByteCount,
    bans: Bans,
    pub(crate) routing: AssetRouting,
}

/// A worker from which another one is to fetch an asset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AssetPeer {
    pub(crate) worker: WorkerId,
    /// Address of its peer server.
    pub(crate) address: SocketAddr,
    /// Hash of its public key, where connections use TLS.
    pub(crate) key: Option<KeyHash>,
    /// Generation of the key of which a token is made now.
    pub(crate) generation: u64,
}

/// A message could not be queued: the worker does not read its messages, or its session has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SendFailed;

impl Sessions {
    /// Adds a session.
    pub(crate) fn insert(&mut self, worker: WorkerId, session: Session) {
        self.sessions.insert(worker, session);
    }

    pub(crate) fn get(&self, worker: WorkerId) -> Option<&Session> {
        self.sessions.get(&worker)
    }

    pub(crate) fn get_mut(&mut self, worker: WorkerId) -> Option<&mut Session> {
        self.sessions.get_mut(&worker)
    }

    pub(crate) fn len(&self) -> usize {
        self.sessions.len()
    }

    pub(crate) fn ids(&self) -> Vec<WorkerId> {
        self.sessions.keys().copied().collect()
    }

    /// The workers whose sessions match.
    pub(crate) fn ids_with(&self, which: impl Fn(&Session) -> bool) -> Vec<WorkerId> {
        self.sessions.iter().filter(|(_, session)| which(session)).map(|(&id, _)| id).collect()
    }

    /// Render threads of all workers.
    pub(crate) fn threads(&self) -> u32 {
        self.sessions.values().fold(0, |sum, session| sum.saturating_add(session.hello.threads))
    }

    /// The last failures of the first few workers that have one, as text for an error message.
    pub(crate) fn failures(&self) -> String {
        let failures = self.sessions.values().filter_map(|session| {
            Some(format!("{}: {}", session.hello.name, session.last_failure.as_ref()?))
        });
        failures.take(MAX_LISTED_FAILURES).collect::<Vec<_>>().join("; ")
    }

    /// Queues a message. A worker whose queue is full is disconnected.
    ///
    /// # Errors
    /// [`SendFailed`], when the session has been ended because of it.
    pub(crate) fn send(&mut self, worker: WorkerId, message: ToWorker) -> Result<(), SendFailed> {
        let Some(session) = self.sessions.get(&worker) else { return Ok(()) };
        let Err(error) = session.sender.try_send(message) else { return Ok(()) };
        self.log_disconnect(worker, &format!("cannot send to it: {error}"));
        self.disconnect(worker, "the worker does not read its messages", Reconnect::Now);
        Err(SendFailed)
    }

    /// Logs as a warning that the master ends a session, where its beginning was logged.
    pub(crate) fn log_disconnect(&self, worker: WorkerId, reason: &str) {
        match self.sessions.get(&worker) {
            Some(Session { hello, address, is_logged: true, .. }) => {
                tracing::warn!("{worker} ({}, {address}) is disconnected: {reason}", hello.name);
            }
            Some(Session { hello, address, .. }) => {
                tracing::debug!("{worker} ({}, {address}) is disconnected: {reason}", hello.name);
            }
            None => {}
        }
    }

    /// Logs that a worker leaves as intended.
    pub(crate) fn log_leave(&self, worker: WorkerId, reason: &str) {
        if let Some(Session { hello, address, .. }) = self.sessions.get(&worker) {
            tracing::info!("{worker} ({}, {address}) leaves: {reason}", hello.name);
        }
    }

    /// Removes a session and sends its disconnect message in the background, with the reason and whether to reconnect. The task ends
    /// when the message is sent or has timed out.
    pub(crate) fn disconnect(
        &mut self,
        worker: WorkerId,
        reason: &str,
        reconnect: Reconnect,
    ) -> Option<JoinHandle<()>> {
        let Session { sender, traffic, identity, .. } = self.sessions.remove(&worker)?;
        self.ended.add(&traffic);
        self.routing.remove_worker(worker);
        self.bans.add_disconnected(worker, identity);
        Some(session::send_disconnect(sender, reason, reconnect))
    }

    /// Bans a worker that is connected or has disconnected lately. A current session is not ended by this.
    pub(crate) fn ban(&mut self, worker: WorkerId) {
        let connected = self.sessions.get(&worker).map(|session| &session.identity);
        if let Some(identity) = connected.or_else(|| self.bans.disconnected(worker)).cloned() {
            self.bans.ban(worker, identity);
        }
    }

    /// Whether a worker is refused when it connects.
    pub(crate) fn is_banned(&self, identity: &Identity) -> bool {
        self.bans.is_banned(identity)
    }

    /// Lifts the bans that `which` selects. Returns the identities.
    pub(crate) fn allow(&mut self, which: impl Fn(&PastWorker) -> bool) -> Vec<Identity> {
        self.bans.allow(which)
    }

    /// All banned workers, oldest ban first.
    pub(crate) fn banned(&self) -> impl Iterator<Item = &PastWorker> {
        self.bans.banned()
    }

    /// The worker from which a worker is to fetch an asset; `None`: from the master.
    pub(crate) fn asset_peer(
        &mut self,
        now: Duration,
        worker: WorkerId,
        id: AssetId,
        again: bool,
    ) -> Option<AssetPeer> {
        // A worker on this machine serves on a loopback address, which other machines cannot reach.
        let is_local =
            |id: WorkerId| self.sessions.get(&id).map(|session| session.address.ip().is_loopback());
        let local = is_local(worker);
        match self.routing.route(now, worker, id, again, |other| is_local(other) == local) {
            AssetSource::Worker(from) => {
                let Session { peer_server, key, .. } = self.sessions.get(&from)?;
                let server = peer_server.as_ref()?;
                let (address, generation) = (server.address, server.token_generation(now));
                Some(AssetPeer { worker: from, address, key: *key, generation })
            }
            AssetSource::Master => None,
        }
    }

    /// Drops what is known about transfers of all assets but those that `is_kept` selects.
    pub(crate) fn retain_assets(&mut self, is_kept: impl Fn(AssetId) -> bool) {
        self.routing.retain(&is_kept);
        self.sessions.values_mut().for_each(|session| session.transfers.retain(&is_kept));
    }

    /// Bytes sent and received by all sessions, ended ones included.
    pub(crate) fn byte_count(&self) -> ByteCount {
        let mut sum = self.ended;
        self.sessions.values().for_each(|session| sum.add(&session.traffic));
        sum
    }
}
