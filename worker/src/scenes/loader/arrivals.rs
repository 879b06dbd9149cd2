//! Assets that arrive from the master or from another worker.

use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::{AssetId, limits};

use super::step::{AssetRequest, Step};
use super::{Incoming, SceneLoader};
use crate::peer::{PeerEvent, PeerSource};
use crate::renderer::Renderer;
use crate::scenes::transfer::{Transfer, TransferError};

/// An asset in transfer.
pub(super) struct Arrival {
    transfer: Transfer,
    size: u64,
    origin: Origin,
    /// Whether any byte came from another worker. A damaged asset is then requested from the master.
    from_peer: bool,
}

/// Sender of the next bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Origin {
    Master,
    Peer,
    /// The master, after its announcement: the transfer from another worker has failed.
    PendingMaster,
}

impl<R: Renderer> SceneLoader<R> {
    /// Handles the master's announcement of an asset, or of the rest of one.
    pub(crate) fn handle_asset_begin(&mut self, id: AssetId, size: u64) {
        match self.incoming.get_mut(&id) {
            Some((Incoming::Requested, _)) => self.begin_transfer(id, size, Origin::Master),
            Some((Incoming::Arriving(arrival), _)) if arrival.origin == Origin::PendingMaster => {
                if arrival.size == size {
                    arrival.origin = Origin::Master;
                } else {
                    let reason =
                        format!("asset {id} is announced with {} bytes, and then with {size}", arrival.size);
                    self.fail(id, &reason);
                }
            }
            _ => tracing::warn!("the master sends asset {id}, which was not requested; it is ignored"),
        }
    }

    /// Handles the master's reference to another worker that serves an asset.
    pub(crate) fn handle_asset_from(&mut self, id: AssetId, size: u64, source: PeerSource) {
        if !matches!(self.incoming.get(&id), Some((Incoming::Requested, _))) {
            tracing::warn!("the master names a worker for asset {id}, which was not requested");
            return;
        }
        self.begin_transfer(id, size, Origin::Peer);
        if matches!(self.incoming.get(&id), Some((Incoming::Arriving(_), _))) {
            self.steps.push_back(Step::FetchFromPeer { id, size, source });
        }
    }

    fn begin_transfer(&mut self, id: AssetId, size: u64, origin: Origin) {
        let begun =
            self.reserve(id, size).and_then(|()| Transfer::begin(id, size).map_err(|e| e.to_string()));
        match begun {
            Ok(transfer) => {
                if self.serves_peers && size > limits::MAX_CHUNK_BYTES as u64 {
                    self.steps.push_back(Step::Serve(id, Arc::clone(transfer.asset())));
                }
                let arrival = Arrival { transfer, size, origin, from_peer: origin == Origin::Peer };
                self.incoming.insert(id, (Incoming::Arriving(arrival), size));
                self.finish_if_complete(id);
            }
            Err(reason) => self.fail(id, &reason),
        }
    }

    /// Makes room in memory for an asset of `size` bytes.
    pub(super) fn reserve(&mut self, id: AssetId, size: u64) -> Result<(), String> {
        if self.loads.contains_key(&id) && size > limits::MAX_DECODE_BYTES as u64 {
            let limit = limits::MAX_DECODE_BYTES;
            return Err(format!("the scene body has {size} bytes, at most {limit} are decoded"));
        }
        let reserved: u64 = self.incoming.values().map(|(_, bytes)| bytes).sum();
        let needed = self.in_use();
        if !self.store.make_room(size, reserved, &needed) {
            let limit_mib = self.store.limit_bytes() >> 20;
            return Err(format!(
                "the scene's assets need more than the {limit_mib} MiB that this worker keeps; \
                 start it with a larger --asset-cache"
            ));
        }
        Ok(())
    }

    /// Handles a chunk from the master. Chunks of a failed or dropped asset are ignored.
    pub(crate) fn handle_asset_chunk(&mut self, id: AssetId, offset: u64, bytes: &[u8]) {
        if let Err(error) = self.append(id, offset, bytes, Origin::Master) {
            self.fail(id, &error.to_string());
        }
    }

    /// Handles an event of a transfer from another worker. After a failure the rest is requested from the master.
    pub(crate) fn handle_peer_event(&mut self, event: PeerEvent) {
        match event {
            PeerEvent::Chunk { id, offset, bytes } => {
                if let Err(error) = self.append(id, offset, &bytes, Origin::Peer) {
                    self.resume_from_master(id, &error.to_string());
                }
            }
            PeerEvent::Failed { id, why } => self.resume_from_master(id, &why),
        }
    }

    fn append(&mut self, id: AssetId, offset: u64, bytes: &[u8], from: Origin) -> Result<(), TransferError> {
        let Some((Incoming::Arriving(arrival), _)) = self.incoming.get_mut(&id) else { return Ok(()) };
        if arrival.origin != from {
            return Ok(());
        }
        arrival.transfer.append(offset, bytes)?;
        self.finish_if_complete(id);
        Ok(())
    }

    fn resume_from_master(&mut self, id: AssetId, why: &str) {
        let Some((Incoming::Arriving(arrival), _)) = self.incoming.get_mut(&id) else { return };
        if arrival.origin == Origin::Peer {
            let offset = arrival.transfer.asset().len() as u64;
            tracing::info!("{why}; asset {id} is requested from the master from byte {offset} on");
            arrival.origin = Origin::PendingMaster;
            self.steps.push_back(Step::Request(AssetRequest { id, offset, again: true }));
        }
    }

    /// Handles the master's report that it does not have an asset.
    pub(crate) fn handle_asset_unknown(&mut self, id: AssetId) {
        if self.incoming.contains_key(&id) {
            let failed = self.failed_without(id, &format!("the master does not have asset {id}"));
            self.absent.extend(failed);
        }
    }

    /// Starts to decode an asset whose bytes are complete. Its bytes stay reserved until it is decoded.
    fn finish_if_complete(&mut self, id: AssetId) {
        let Some((state, _)) = self.incoming.get_mut(&id) else { return };
        if !matches!(state, Incoming::Arriving(arrival) if arrival.transfer.is_complete()) {
            return;
        }
        let Incoming::Arriving(arrival) = std::mem::replace(state, Incoming::Decoding) else { return };
        let Arrival { transfer, from_peer, .. } = arrival;
        match transfer.finish() {
            Ok(bytes) => self.accept(id, bytes),
            Err(error @ TransferError::Damaged { .. }) if from_peer => {
                tracing::warn!(
                    "{error}; another worker sent wrong bytes, the master is requested to send all"
                );
                self.incoming.insert(id, (Incoming::Requested, 0));
                self.steps.push_back(Step::Request(AssetRequest { id, offset: 0, again: true }));
            }
            Err(error @ TransferError::Damaged { .. }) => {
                self.fail(id, &format!("{error}; the master's memory or its software is faulty"));
            }
            Err(error) => self.fail(id, &error.to_string()),
        }
        self.start_requests();
    }

    fn accept(&mut self, id: AssetId, bytes: Bytes) {
        self.decode(id, bytes.clone());
        if self.serves_peers && bytes.len() > limits::MAX_CHUNK_BYTES {
            self.steps.push_back(Step::Arrived(id));
        }
        if self.has_disk {
            self.steps.push_back(Step::Save(id, bytes));
        }
    }
}
