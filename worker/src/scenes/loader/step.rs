//! Steps that the scene loader requests, and their results.

use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::AssetId;

use crate::cancel::CancelFlag;
use crate::peer::{PartialAsset, PeerSource};
use crate::renderer::Renderer;

/// Step that the loader requests, or an event that it reports.
pub(crate) enum Step<R: Renderer> {
    /// Request an asset from the master.
    Request(AssetRequest),
    /// Fetch an asset of `size` bytes from another worker.
    FetchFromPeer { id: AssetId, size: u64, source: PeerSource },
    /// Serve an asset to other workers while it arrives.
    Serve(AssetId, Arc<PartialAsset>),
    /// Report to the master that an asset has arrived.
    Arrived(AssetId),
    /// Run work on a blocking thread.
    Work(SceneWork<R>),
    /// Write an asset to the disk cache.
    Save(AssetId, Bytes),
    /// The scene is compiled, so frames of it can be prepared.
    Ready(AssetId, Arc<R::Scene>),
    /// The scene cannot be loaded, for this reason.
    Failed(AssetId, String),
}

/// Request for an asset to the master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AssetRequest {
    pub(crate) id: AssetId,
    /// First byte that is requested.
    pub(crate) offset: u64,
    /// Whether a transfer from another worker has failed.
    pub(crate) again: bool,
}

/// Work for a blocking thread.
pub(crate) enum SceneWork<R: Renderer> {
    /// Look for the asset on the disk.
    Find { id: AssetId },
    /// Read the asset of `size` bytes from the disk.
    Read { id: AssetId, size: u64 },
    /// Decode a scene body.
    DecodeScene { id: AssetId, body: Bytes },
    /// Decode a mesh or a texture.
    DecodePart { id: AssetId, bytes: Bytes },
    /// Compile a scene from its body and its parts.
    Compile { id: AssetId, draft: R::Draft, parts: Vec<Arc<R::Part>>, cancel: CancelFlag },
}

/// Result of a [`SceneWork`].
pub(crate) enum SceneResult<R: Renderer> {
    /// Size of the asset on the disk, if it is there.
    Found { id: AssetId, size: Option<u64> },
    /// Bytes of the asset from the disk, if they match its hash.
    Read { id: AssetId, bytes: Option<Vec<u8>> },
    /// The decoded scene body and the ids of its parts.
    SceneDecoded { id: AssetId, result: Result<(R::Draft, Vec<AssetId>), String> },
    /// The decoded mesh or texture.
    PartDecoded { id: AssetId, result: Result<R::Part, String> },
    /// The compiled scene.
    Compiled { id: AssetId, result: Result<R::Scene, String> },
}
