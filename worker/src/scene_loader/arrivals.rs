//! Assets on their way in, from the master or from another worker.

use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::{AssetId, limits};

use super::step::{Step, Wish};
use super::{Incoming, SceneLoader};
use crate::fetch::{FromPeer, Peer};
use crate::renderer::Renderer;
use crate::transfer::{Transfer, TransferError};

/// An asset that arrives.
pub(super) struct Arrival {
    transfer: Transfer,
    size: u64,
    origin: Origin,
    /// Whether any of its bytes came from another worker: if it is damaged, the master has a whole one.
    passed_on: bool,
}

/// Whose bytes are awaited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Origin {
    Master,
    Peer,
    /// The master's, when it has announced them: another worker has failed.
    Announcement,
}

impl<R: Renderer> SceneLoader<R> {
    /// The master announces an asset, or the rest of one.
    pub(crate) fn begin(&mut self, id: AssetId, size: u64) {
        match self.incoming.get_mut(&id) {
            Some((Incoming::Asked, _)) => self.arrive(id, size, Origin::Master),
            Some((Incoming::Arriving(arrival), _)) if arrival.origin == Origin::Announcement => {
                if arrival.size == size {
                    arrival.origin = Origin::Master;
                } else {
                    let told = format!("asset {id} has {} bytes, and then {size}", arrival.size);
                    self.fail(id, &told);
                }
            }
            _ => tracing::warn!("the master sends asset {id}, which was not asked for; it is not kept"),
        }
    }

    /// The master says which worker passes an asset on.
    pub(crate) fn begin_from(&mut self, id: AssetId, size: u64, peer: Peer) {
        if !matches!(self.incoming.get(&id), Some((Incoming::Asked, _))) {
            tracing::warn!("the master names a worker for asset {id}, which was not asked for");
            return;
        }
        self.arrive(id, size, Origin::Peer);
        if matches!(self.incoming.get(&id), Some((Incoming::Arriving(_), _))) {
            self.steps.push_back(Step::Fetch { id, size, peer });
        }
    }

    fn arrive(&mut self, id: AssetId, size: u64, origin: Origin) {
        let begun = self.admit(id, size).and_then(|()| Transfer::begin(id, size).map_err(|e| e.to_string()));
        match begun {
            Ok(transfer) => {
                if self.shares && size > limits::MAX_CHUNK_BYTES as u64 {
                    self.steps.push_back(Step::Shelve(id, Arc::clone(transfer.bytes())));
                }
                let arrival = Arrival { transfer, size, origin, passed_on: origin == Origin::Peer };
                self.incoming.insert(id, (Incoming::Arriving(arrival), size));
                self.complete(id);
            }
            Err(reason) => self.fail(id, &reason),
        }
    }

    /// Makes room for an asset of that size.
    pub(super) fn admit(&mut self, id: AssetId, size: u64) -> Result<(), String> {
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

    /// A part of an asset from the master. Parts of what was given up meanwhile are dropped.
    pub(crate) fn chunk(&mut self, id: AssetId, offset: u64, bytes: &[u8]) {
        if let Err(error) = self.take(id, offset, bytes, Origin::Master) {
            self.fail(id, &error.to_string());
        }
    }

    /// What another worker passes on. Where it fails, the master is asked for the rest.
    pub(crate) fn passed(&mut self, from: FromPeer) {
        match from {
            FromPeer::Chunk { id, offset, bytes } => {
                if let Err(error) = self.take(id, offset, &bytes, Origin::Peer) {
                    self.let_down(id, &error.to_string());
                }
            }
            FromPeer::Failed { id, why } => self.let_down(id, &why),
        }
    }

    fn take(&mut self, id: AssetId, offset: u64, bytes: &[u8], from: Origin) -> Result<(), TransferError> {
        let Some((Incoming::Arriving(arrival), _)) = self.incoming.get_mut(&id) else { return Ok(()) };
        if arrival.origin != from {
            return Ok(());
        }
        arrival.transfer.chunk(offset, bytes)?;
        self.complete(id);
        Ok(())
    }

    fn let_down(&mut self, id: AssetId, why: &str) {
        let Some((Incoming::Arriving(arrival), _)) = self.incoming.get_mut(&id) else { return };
        if arrival.origin == Origin::Peer {
            let offset = arrival.transfer.bytes().len() as u64;
            tracing::info!(
                "{why}; the master is asked for what is missing of asset {id}, from byte {offset} on"
            );
            arrival.origin = Origin::Announcement;
            self.steps.push_back(Step::Ask(Wish { id, offset, again: true }));
        }
    }

    /// The master does not have an asset.
    pub(crate) fn unknown(&mut self, id: AssetId) {
        if self.incoming.contains_key(&id) {
            self.fail(id, &format!("the master does not have asset {id}"));
        }
    }

    /// Hands a complete asset to be decoded; its bytes stay reserved until that is done.
    fn complete(&mut self, id: AssetId) {
        let Some((state, _)) = self.incoming.get_mut(&id) else { return };
        if !matches!(state, Incoming::Arriving(arrival) if arrival.transfer.is_complete()) {
            return;
        }
        let Incoming::Arriving(arrival) = std::mem::replace(state, Incoming::Decoding) else { return };
        let Arrival { transfer, passed_on, .. } = arrival;
        match transfer.finish() {
            Ok(bytes) => self.taken(id, bytes),
            Err(error @ TransferError::Damaged { .. }) if passed_on => {
                tracing::warn!(
                    "{error}: a worker that passed it on is at fault; the master is asked for all of it"
                );
                self.incoming.insert(id, (Incoming::Asked, 0));
                self.steps.push_back(Step::Ask(Wish { id, offset: 0, again: true }));
            }
            Err(error @ TransferError::Damaged { .. }) => {
                self.fail(id, &format!("{error}; the master's memory or its software is at fault"));
            }
            Err(error) => self.fail(id, &error.to_string()),
        }
        self.ask();
    }

    fn taken(&mut self, id: AssetId, bytes: Bytes) {
        self.decode(id, bytes.clone());
        if self.shares && bytes.len() > limits::MAX_CHUNK_BYTES {
            self.steps.push_back(Step::Taken(id));
        }
        if self.has_disk {
            self.steps.push_back(Step::Save(id, bytes));
        }
    }
}
