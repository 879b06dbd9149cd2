//! Requests for assets, and asset transfers from worker to worker as [`AssetRouting`] decides.
//!
//! [`AssetRouting`]: crate::assets::routing::AssetRouting

use std::net::SocketAddr;

use rayfarm_protocol::peer::Token;
use rayfarm_protocol::{AssetId, ToWorker};
use rayfarm_scheduler::{Event, WorkerId};
use tokio::time::{Instant, MissedTickBehavior, interval_at};
use tokio_util::sync::CancellationToken;

use super::perform::send;
use super::{Driver, Inner};
use crate::assets::peer_endpoint::{KEY_INTERVAL, PeerEndpoint, share_key};
use crate::assets::routing::MAX_DIRECT_BYTES;
use crate::sessions::AssetPeer;

impl Driver {
    /// Registers a worker's peer server, by its port, and sends the worker its key.
    pub(crate) fn add_peer_server(&self, worker: WorkerId, port: u16) {
        if self.secret.is_none() {
            return;
        }
        let mut inner = self.lock();
        let now = self.started.elapsed();
        let Some(session) = inner.sessions.get_mut(worker) else { return };
        let address = SocketAddr::new(session.address.ip(), port);
        let Some(endpoint) = PeerEndpoint::new(address, session.peer_server, now) else {
            tracing::debug!("{worker} serves assets at {address}, a port of the system, which is not used");
            return;
        };
        session.peer_server = Some(endpoint);
        inner.sessions.routing.add_peer_server(worker);
        self.send_share_key(&mut inner, worker, endpoint.generation());
    }

    /// Gives each peer server a new key at an interval, until `stop`.
    pub(crate) async fn keep_share_keys_new(&self, stop: CancellationToken) {
        let mut ticks = interval_at(Instant::now() + KEY_INTERVAL, KEY_INTERVAL);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        while stop.run_until_cancelled(ticks.tick()).await.is_some() {
            self.renew_share_keys();
        }
    }

    /// Gives each peer server a new key. Tokens of the key before its last one are invalid then.
    pub(crate) fn renew_share_keys(&self) {
        let mut inner = self.lock();
        let now = self.started.elapsed();
        for worker in inner.sessions.ids() {
            let server = inner.sessions.get_mut(worker).and_then(|session| session.peer_server.as_mut());
            let Some(endpoint) = server else { continue };
            endpoint.renew(now);
            let generation = endpoint.generation();
            self.send_share_key(&mut inner, worker, generation);
        }
    }

    fn send_share_key(&self, inner: &mut Inner, worker: WorkerId, generation: u64) {
        let Some(secret) = &self.secret else { return };
        let key = share_key(secret, worker, generation);
        let lost = send(inner, worker, ToWorker::ShareKey { key, generation });
        lost.into_iter().for_each(|event| self.drive(inner, event));
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
        let Some(source) = inner.sessions.asset_peer(now, worker, id, again) else { return false };
        let (Some(secret), Some(session)) = (&self.secret, inner.sessions.get(worker)) else { return false };
        let AssetPeer { worker: holder, address: peer, key: peer_key, generation } = source;
        // The token is bound to the worker that requests the asset, so no other worker can use it.
        let token = Token::new(&share_key(secret, holder, generation), id, session.key, generation);
        let message = ToWorker::AssetFrom { id, size: size as u64, peer, peer_key, token };
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
