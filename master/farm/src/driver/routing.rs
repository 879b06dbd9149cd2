//! Assets that workers pass on to each other, as [`Chains`](crate::assets::routing::Chains) say.

use std::net::SocketAddr;

use rayfarm_protocol::passing::{ShareKey, token};
use rayfarm_protocol::{AssetId, ToWorker};

use super::Driver;
use super::perform::send;
use crate::assets::routing::LEAST_PASSED_BYTES;
use rayfarm_scheduler::{Event, WorkerId};

impl Driver {
    /// A worker passes assets on at a port of its own, and is given its key.
    pub(crate) fn shares(&self, worker: WorkerId, port: u16) {
        let Some(secret) = &self.secret else { return };
        let mut inner = self.lock();
        let key = ShareKey(blake3::keyed_hash(secret, &worker.0.to_le_bytes()).into());
        let Some(session) = inner.roster.get_mut(worker) else { return };
        session.sharing = Some((SocketAddr::new(session.address.ip(), port), key));
        inner.roster.chains.shares(worker);
        let lost = send(&mut inner, worker, ToWorker::ShareKey { key });
        lost.into_iter().for_each(|event| self.drive(&mut inner, event));
    }

    /// A worker asks for an asset. Whether another worker passes it on: the one that asks is told which. `again`: that was
    /// tried.
    pub(crate) fn asset_wanted(&self, worker: WorkerId, id: AssetId, offset: u64, again: bool) -> bool {
        let mut inner = self.lock();
        let now = self.started.elapsed();
        inner.accounts.asset_wanted(now, worker);
        let size = self.assets.get(id).map_or(0, |bytes| bytes.len());
        if let Some(session) = inner.roster.get_mut(worker).filter(|_| size > 0) {
            session.transfers.requested(id, size as u64, offset);
        }
        if size <= LEAST_PASSED_BYTES {
            return false;
        }
        let Some((peer, key)) = inner.roster.source(now, worker, id, again) else { return false };
        let message = ToWorker::AssetFrom { id, size: size as u64, peer, token: token(&key, id) };
        let lost = send(&mut inner, worker, message);
        lost.into_iter().for_each(|event| self.drive(&mut inner, event));
        true
    }

    /// The bytes of an asset up to `end` are on their way to a worker.
    pub(crate) fn asset_sent(&self, worker: WorkerId, id: AssetId, end: u64) {
        let mut inner = self.lock();
        if let Some(session) = inner.roster.get_mut(worker) {
            session.transfers.sent(id, end);
        }
        self.drive(&mut inner, Event::Heard { worker });
    }

    /// A worker has all of an asset.
    pub(crate) fn asset_taken(&self, worker: WorkerId, id: AssetId) {
        let mut inner = self.lock();
        if let Some(session) = inner.roster.get_mut(worker) {
            session.transfers.complete(id);
        }
        inner.roster.chains.complete(self.started.elapsed(), worker, id);
        self.drive(&mut inner, Event::Heard { worker });
    }
}
