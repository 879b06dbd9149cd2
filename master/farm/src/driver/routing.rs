//! Requests for assets, and asset transfers from worker to worker as [`AssetRouting`] decides.
//!
//! [`AssetRouting`]: crate::assets::routing::AssetRouting

use std::net::SocketAddr;

use rayfarm_protocol::peer::{ShareKey, Token};
use rayfarm_protocol::transport::MasterSecurity;
use rayfarm_protocol::{AssetId, ToWorker};
use rayfarm_scheduler::{Event, WorkerId};

use super::Driver;
use super::perform::send;
use crate::assets::routing::MAX_DIRECT_BYTES;

impl Driver {
    /// Registers a worker's peer server, by its port, and sends the worker its key.
    pub(crate) fn add_peer_server(&self, worker: WorkerId, port: u16) {
        let Some(secret) = &self.secret else { return };
        // Connections between workers are plain: a farm that uses TLS sends each asset itself.
        if self.security != MasterSecurity::Plain {
            return;
        }
        let mut inner = self.lock();
        let key = ShareKey(blake3::keyed_hash(secret, &worker.0.to_le_bytes()).into());
        let Some(session) = inner.sessions.get_mut(worker) else { return };
        session.peer_server = Some((SocketAddr::new(session.address.ip(), port), key));
        inner.sessions.routing.add_peer_server(worker);
        let lost = send(&mut inner, worker, ToWorker::ShareKey { key });
        lost.into_iter().for_each(|event| self.drive(&mut inner, event));
    }

    /// Routes a worker's request for an asset from `offset` on. Returns whether another worker serves it; the worker is then
    /// sent the address. Otherwise the master is to send the asset. `again`: the previous source has failed.
    pub(crate) fn asset_requested(&self, worker: WorkerId, id: AssetId, offset: u64, again: bool) -> bool {
        let mut inner = self.lock();
        let now = self.started.elapsed();
        inner.accounts.asset_requested(now, worker);
        let size = self.assets.get(id).map_or(0, |bytes| bytes.len());
        if let Some(session) = inner.sessions.get_mut(worker).filter(|_| size > 0) {
            session.transfers.requested(id, size as u64, offset);
        }
        if size <= MAX_DIRECT_BYTES {
            return false;
        }
        let Some((peer, key)) = inner.sessions.asset_peer(now, worker, id, again) else { return false };
        let message = ToWorker::AssetFrom { id, size: size as u64, peer, token: Token::new(&key, id) };
        let lost = send(&mut inner, worker, message);
        lost.into_iter().for_each(|event| self.drive(&mut inner, event));
        true
    }

    /// Notes that the bytes of an asset up to `end` are queued for a worker.
    pub(crate) fn asset_sent(&self, worker: WorkerId, id: AssetId, end: u64) {
        let mut inner = self.lock();
        if let Some(session) = inner.sessions.get_mut(worker) {
            session.transfers.sent(id, end);
        }
        self.drive(&mut inner, Event::Heard { worker });
    }

    /// Notes that a worker has received all of an asset.
    pub(crate) fn asset_received(&self, worker: WorkerId, id: AssetId) {
        let mut inner = self.lock();
        if let Some(session) = inner.sessions.get_mut(worker) {
            session.transfers.complete(id);
        }
        inner.sessions.routing.complete(self.started.elapsed(), worker, id);
        self.drive(&mut inner, Event::Heard { worker });
    }
}
