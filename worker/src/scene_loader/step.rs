//! What the loader of scenes wants done, and what became of it.

use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::AssetId;

use crate::fetch::Peer;
use crate::growing::Growing;
use crate::renderer::Renderer;
use crate::wanted::Wanted;

/// Something to be done, or known.
pub(crate) enum Step<R: Renderer> {
    /// Ask the master for an asset.
    Ask(Wish),
    /// Get an asset of that size from another worker.
    Fetch { id: AssetId, size: u64, peer: Peer },
    /// This asset comes in, and may be passed on.
    Shelve(AssetId, Arc<Growing>),
    /// This asset is here.
    Taken(AssetId),
    /// Do this on a blocking thread.
    Work(SceneWork<R>),
    /// Keep this asset on the disk, when there is time.
    Save(AssetId, Bytes),
    /// Frames of this scene can be prepared.
    Ready(AssetId, Arc<R::Scene>),
    /// Frames of this scene cannot be rendered here.
    Failed(AssetId, String),
}

/// What is asked of the master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Wish {
    pub(crate) id: AssetId,
    /// From which byte on.
    pub(crate) offset: u64,
    /// Whether another worker was to pass it on, and did not.
    pub(crate) again: bool,
}

/// Work that takes its time.
pub(crate) enum SceneWork<R: Renderer> {
    /// See whether the disk has it.
    Find {
        id: AssetId,
    },
    /// Read it from there.
    Read {
        id: AssetId,
        size: u64,
    },
    DecodeScene {
        id: AssetId,
        body: Bytes,
    },
    DecodePart {
        id: AssetId,
        bytes: Bytes,
    },
    Compile {
        id: AssetId,
        draft: R::Draft,
        parts: Vec<Arc<R::Part>>,
        wanted: Wanted,
    },
}

/// What became of it.
pub(crate) enum SceneDone<R: Renderer> {
    Found { id: AssetId, size: Option<u64> },
    Read { id: AssetId, bytes: Option<Vec<u8>> },
    SceneDecoded { id: AssetId, result: Result<(R::Draft, Vec<AssetId>), String> },
    PartDecoded { id: AssetId, result: Result<R::Part, String> },
    Compiled { id: AssetId, result: Result<R::Scene, String> },
}
